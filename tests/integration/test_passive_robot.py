# SPDX-License-Identifier: Apache-2.0
"""A robot without motors: it runs, it is delayed, and no run is sent to it."""

from pathlib import Path

import numpy as np
import pytest
from tests.models import stepped
from tests.places import ROOT
from tests.robots import like
from tests.simulate import bag, record

from leo_msgs_py.cli import main
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

PASSIVE = ROOT / 'benchmarks/rigs/map_pendulum'


@pytest.fixture
def driven(tmp_path: Path) -> Path:
    """The rig with an actuator, that nobody commands."""
    motor = 'actuators:\n  pivot:\n    limit: {value: 1, unit: N m}\n'
    return like(load_robot(PASSIVE), tmp_path / 'driven', ('actuators: {}\n', motor)).folder


@pytest.mark.parametrize('name', [None, 'viscous_friction', 'measurement_delay'])
def test_it_swings_as_one_whose_motor_gives_nothing(name, driven):
    states = []
    for folder in (driven, PASSIVE):
        robot = load_robot(folder)
        values = {'viscous_friction': {'b': 1e-3}, 'measurement_delay': {'delay': 0.01}}
        placed = (place(robot, name, 'all', **values[name]),) if name else ()
        track = stepped(Model(robot, effects=placed), np.zeros((20, len(robot.actuators))), 0.01)
        states.append(np.concatenate(track, axis=1)[-1])
    assert states[0] == pytest.approx(states[1], abs=1e-12)


def test_leo_next_has_no_run_for_it(driven, tmp_path, capsys):
    bag(tmp_path / 'bag', record(load_robot(driven), seconds=2))
    argv = ['next', str(tmp_path / 'bag'), '--model', str(PASSIVE), '-o', str(tmp_path / 'n.csv')]
    assert main(argv) == 2
    assert 'has no motors' in capsys.readouterr().err
