# SPDX-License-Identifier: Apache-2.0
"""`leo reveal FILE`: open the sealed truth about a robot's hidden effects."""

from collections.abc import Mapping
import json
from pathlib import Path
from typing import Any

import yaml

from leo_msgs_py.verbs.common import Parser
from leo_sim.truth.sealing import unseal

EXAMPLES = """\
  leo run leo_sim robot --ros-args -p robot:=pendulum -p hidden_seed:=7 -p sealed:=truth.sealed
  leo reveal truth.sealed
  leo reveal truth.sealed --json
"""


def read_sealed(path: str | Path) -> dict[str, Any]:
    """The truth in a sealed file: {'robot': name, 'effects': [{name, where, parameters}]}."""
    return dict(yaml.safe_load(unseal(Path(path))))


def main(argv: list[str]) -> int:
    parser = Parser('leo reveal', 'Open the sealed truth about hidden effects.', EXAMPLES)
    parser.add('file', 'the file the robot printed as "sealed: FILE"')
    options = parser.parse_args(argv)
    truth = read_sealed(options.file)
    lines = [f'robot {truth["robot"]}: {len(truth["effects"])} hidden effect(s)']
    lines += [f'  {described(effect)}' for effect in truth['effects']]
    print(json.dumps(truth, indent=2) if options.json else '\n'.join(lines))
    return 0


def described(effect: Mapping[str, Any]) -> str:
    where = effect['where']
    places = where if isinstance(where, str) else ', '.join(where)
    values = ', '.join(_value(name, entry) for name, entry in effect['parameters'].items())
    return f'{effect["name"]} at {places}: {values}'


def _value(name: str, entry: Mapping[str, Any]) -> str:
    text = f'{name} = {entry["value"]:.4g} {entry["unit"]}'.rstrip()
    if entry.get('ci95'):
        text += ' [{:.3g}, {:.3g}]'.format(*entry['ci95'])
    return text
