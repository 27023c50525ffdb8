# SPDX-License-Identifier: Apache-2.0
"""A card: a public rig, what is known of it, and which of its logs nothing may be fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
import subprocess
import sys

from benchmarks.rig import imported, leo
from pydantic import BaseModel, ConfigDict, ValidationError
import yaml

from leo_diffmodel.bags.recording import read_bag, Recording
from leo_diffmodel.compare.known import with_known
from leo_msgs_py.errors import UserError
from leo_sim.model import Model
from leo_sim.model.model_file import load_model

HERE = Path(__file__).parent
CARDS, ROOT = HERE / 'cards', HERE.parents[1]


class CardFile(BaseModel):
    """The keys of a card; docs/referee.md says what each is."""

    model_config = ConfigDict(extra='forbid')
    title: str
    source: str
    measured: str
    known: str
    folder: str
    prepare: str | None = None
    one_bag: bool = False
    map: str
    held_out_map: str | None = None
    model: str
    learn: list[str]
    held_out: list[str]
    seconds: float = 0.5
    moving: float = 0.1
    right: list[list[str]]
    allowed: list[str] = []
    mujoco: list[str]


@dataclass(frozen=True)
class Rig:
    """A card with its logs read.

    Attributes:
        card: what the file says.
        model: as given, with what the logs say of the robot.
        learn, held_out: the logs to fit to, and those that no fit sees.
    """

    card: CardFile
    model: Model
    learn: Sequence[Recording]
    held_out: Sequence[Recording]


def names() -> list[str]:
    """Of all cards."""
    return sorted(path.stem for path in CARDS.glob('*.yaml'))


def read_card(name: str) -> CardFile:
    """A card; UserError: no such card, or which key of it is wrong."""
    path = CARDS / f'{name}.yaml'
    if not path.is_file():
        raise UserError(f'no card {name!r}; there are {", ".join(names())}')
    try:
        return CardFile(**yaml.safe_load(path.read_text()))
    except ValidationError as error:
        first = error.errors()[0]
        raise UserError(f'{path}: {".".join(map(str, first["loc"]))}: {first["msg"]}') from error


def public(card: CardFile, data: Sequence[Path]) -> Path:
    """The folder of a rig's files: the first that has it."""
    folder = next((d / card.folder for d in data if (d / card.folder).is_dir()), None)
    if folder is None:
        raise UserError(f'no folder {card.folder} in {", ".join(map(str, data))}')
    return folder


def logs(folder: Path, patterns: Sequence[str]) -> list[Path]:
    """The files of a folder that fit patterns, each of which fits one."""
    each = {pattern: [*folder.glob(pattern)] for pattern in patterns}
    for pattern, found in each.items():
        if not found:
            raise UserError(f'nothing in {folder} is called {pattern}')
    return sorted({path for found in each.values() for path in found})


def make_bags(card: CardFile, data: Sequence[Path], folder: Path) -> None:
    """Import the logs of a rig into `folder`, once; those no column map reads are prepared."""
    source = public(card, data)
    if card.prepare and not (folder / 'prepared').exists():
        command = [sys.executable, ROOT / card.prepare, source, folder / 'prepared']
        subprocess.run([*map(str, command)], check=True)
    source = folder / 'prepared' if card.prepare else source
    maps = {'learn': card.map, 'held_out': card.held_out_map or card.map}
    for part, name in maps.items():
        if not (folder / part).exists():
            column_map = ROOT / name if (ROOT / name).is_file() else name
            found = logs(source, getattr(card, part))
            if card.one_bag:
                leo('import', *found, '--map', column_map, '-o', folder / part / 'all')
            else:
                imported(found, str(column_map), folder / part)


def read_rig(name: str, folder: Path) -> Rig:
    """The rig of a card whose bags lie in a folder; a shipped robot or a folder of the project."""
    card = read_card(name)
    here = ROOT / card.model
    model = load_model(here if here.exists() else card.model)
    learn, held_out = (
        [read_bag(bag, model.robot) for bag in sorted((folder / part).iterdir())]
        for part in ('learn', 'held_out')
    )
    return Rig(card, with_known(model, [*learn, *held_out]), learn, held_out)
