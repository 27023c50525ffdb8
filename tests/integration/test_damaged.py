# SPDX-License-Identifier: Apache-2.0
"""Damaged bags, maps, models, robots, logs and runs: read up to the damage, or one clear line.

LEO_DAMAGED=1000 runs all cases, a tenth run by default; tests/e2e/test_damaged_commands.py runs
some as commands.
"""

from collections import Counter
from collections.abc import Iterator
import faulthandler
from io import StringIO
import os
from pathlib import Path
import shutil
import struct
import time
import warnings

import numpy as np
import pytest
from rich.console import Console
from tests import damage
from tests.damage import Damage, one_line, Rng
from tests.damage_shop import fill, PENDULUM, training

from leo_diffmodel.add.patch import from_explanation
from leo_diffmodel.bags.importing.convert import import_logs
from leo_diffmodel.bags.info import bag_info, show
from leo_diffmodel.bags.recording import read_bag
from leo_learner.learning.checkpoint import load_checkpoint, start_from
from leo_learner.learning.policy import Policy
from leo_msgs_py.bag_contents import load
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.model import Model
from leo_sim.model.batch import rollout
from leo_sim.model.model_file import load_model

CASES = int(os.environ.get('LEO_DAMAGED', '100'))
BATCHES = 10
HANG, BUSY = 1200.0, 30.0  # time that a case may take on the wall, and of a processor [s]
MAGIC = 8
FRAME = struct.Struct('<BQ')
LONE = 2  # states between damage and a break, which make no stretch


@pytest.fixture(scope='module')
def shop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One of each, whole."""
    return fill(tmp_path_factory.mktemp('whole'))


def _bag(root: Path, folder: Path, rng: Rng) -> Damage:
    """Spoil a bag, read it; everything before the record that is damaged must be there."""
    name = ('plain', 'plain', 'zstd', 'lz4')[rng.integers(4)]
    bag = Path(shutil.copytree(root / name, folder / name))
    victims = sorted(bag.iterdir())
    victim = (
        victims[rng.integers(len(victims))] if rng.random() < 0.2 else next(bag.glob('*.mcap'))
    )
    before = victim.read_bytes()
    done = (damage.damage_path if rng.random() < 0.1 else damage.damage_bytes)(victim, rng)
    one_line(lambda: _nothing_lost(bag, victim, before, done))
    one_line(lambda: read_bag(bag, PENDULUM))
    one_line(lambda: show(bag_info(bag), Console(file=StringIO())))
    one_line(lambda: read_bag(bag, PENDULUM))
    return done


def _nothing_lost(bag: Path, victim: Path, before: bytes, done: Damage) -> None:
    """What reads of the records before the damaged one must read of the damaged bag."""
    if victim.suffix != '.mcap' or not victim.is_file() or done.start < MAGIC:
        load(bag)
        return
    prefix = bag.parent / 'prefix.mcap'
    prefix.write_bytes(before[: _record_start(before, done.start)])
    lost = _messages(prefix) - _messages(bag)
    assert not lost, f'{lost.total()} messages lost: {done.what}'
    try:
        kept = _states(prefix)
    except UserError:
        return
    lost = kept - _states(bag)
    assert lost.total() <= LONE, f'{lost.total()} of {kept.total()} states lost: {done.what}'


def _record_start(content: bytes, place: int) -> int:
    """Where the record begins that a place in a whole file belongs to."""
    start = at = MAGIC
    while at <= place:
        start = at
        at += (
            FRAME.size + FRAME.unpack_from(content, at)[1]
            if at + FRAME.size < len(content)
            else len(content)
        )
    return start


def _messages(bag: Path) -> Counter[bytes]:
    return Counter(m.data for topic in load(bag).topics.values() for m in topic.messages)


def _states(bag: Path) -> Counter[float]:
    return Counter(q for e in read_bag(bag, PENDULUM).episodes for q in e.q[:, 0].tolist())


def _map(root: Path, folder: Path, rng: Rng) -> Damage:
    path = Path(shutil.copy(root / 'map.yaml', folder))
    done = _spoiled(path, rng)
    one_line(lambda: read_bag(root / 'plain', PENDULUM, path))
    return done


def _model(root: Path, folder: Path, rng: Rng) -> Damage:
    path = Path(shutil.copy(root / 'model.yaml', folder))
    done = _spoiled(path, rng)
    one_line(lambda: _moved(load_model(path, engine='rigid')))
    return done


def _robot(root: Path, folder: Path, rng: Rng) -> Damage:
    robot = Path(shutil.copytree(root / 'robot', folder / 'robot'))
    if rng.random() < 0.5:
        done = _spoiled(robot / 'robot.yaml', rng)
    else:
        how = (damage.damage_xml, damage.damage_xml, damage.damage_bytes, damage.damage_path)
        done = how[rng.integers(len(how))](robot / 'robot.urdf', rng)
    one_line(lambda: _moved(Model(load_robot(robot), engine='rigid')))
    return done


def _log(root: Path, folder: Path, rng: Rng) -> Damage:
    log, columns = (Path(shutil.copy(root / name, folder)) for name in ('log.csv', 'columns.yaml'))
    if rng.random() < 0.3:
        done = damage.damage_bytes(log, rng)
    else:
        done = _spoiled(columns, rng)
    one_line(lambda: import_logs([log], columns, folder / 'bag'))
    return done


def _explanation(root: Path, folder: Path, rng: Rng) -> Damage:
    name = ('explain.json', 'law.json')[rng.integers(2)]
    path = Path(shutil.copy(root / name, folder))
    done = damage.damage_json(path, rng)
    one_line(lambda: from_explanation(Model(PENDULUM), path))
    return done


def _run(root: Path, folder: Path, rng: Rng) -> Damage:
    """Spoil a file of a training run; a policy that loads must also act."""
    run = Path(shutil.copytree(root / 'run', folder / 'run'))
    victims = sorted(path for path in run.rglob('*') if path.is_file())
    how = (damage.damage_bytes,) * 4 + (damage.damage_path,)
    done = how[rng.integers(len(how))](victims[rng.integers(len(victims))], rng)
    one_line(lambda: load_checkpoint(run, training()))
    one_line(lambda: start_from(run, training()))
    one_line(lambda: _acted(Policy.load(run / 'policy.safetensors')))
    return done


def _acted(policy: Policy) -> None:
    policy.check(PENDULUM)
    with np.errstate(all='ignore'):
        assert policy(np.zeros(3)).shape == (1,)


def _spoiled(path: Path, rng: Rng) -> Damage:
    how = (damage.damage_yaml,) * 6 + (damage.damage_bytes, damage.damage_path)
    return how[rng.integers(len(how))](path, rng)


def _moved(model: Model) -> None:
    """What loads must also run, whatever comes of absurd numbers."""
    start = model.start('nominal')
    inputs = np.zeros((1, 2, len(model.robot.actuators)))
    with np.errstate(all='ignore'):
        rollout(model, start.q[None], start.dq[None], inputs, 1e-3)


KINDS = {
    'bag': (_bag, 0.5),
    'map': (_map, 0.1),
    'model': (_model, 0.1),
    'robot': (_robot, 0.15),
    'log': (_log, 0.1),
    'explanation': (_explanation, 0.05),
    'run': (_run, 0.1),
}


@pytest.fixture
def watched() -> Iterator[None]:
    """A case that hangs ends the process and says where it was."""
    yield
    faulthandler.cancel_dump_traceback_later()


@pytest.mark.usefixtures('watched')
@pytest.mark.parametrize('batch', range(BATCHES))
@pytest.mark.parametrize('kind', KINDS)
def test_damaged_files_never_trip_the_readers(kind, batch, shop, tmp_path):
    spoil, share = KINDS[kind]
    for seed in range(batch, round(CASES * share), BATCHES):
        folder = tmp_path / str(seed)
        folder.mkdir()
        rng = np.random.default_rng([seed, list(KINDS).index(kind)])
        faulthandler.dump_traceback_later(HANG, exit=True)
        began = time.process_time()
        with warnings.catch_warnings():
            warnings.simplefilter('error')
            try:
                done = spoil(shop, folder, rng)
            except Exception as error:
                raise AssertionError(f'{kind} {seed} in {folder}: {error!r}') from error
        assert time.process_time() - began < BUSY, f'{kind} {seed}: {done.what}'
        shutil.rmtree(folder)
