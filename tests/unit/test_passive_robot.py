# SPDX-License-Identifier: Apache-2.0
"""A robot without motors: it runs, it is delayed, and no run is sent to it."""

from pathlib import Path
import shutil

import numpy as np
import pytest
from tests.simulate import bag, record

from leo_msgs_py.cli import main
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.robot import load_robot

DRIVEN = Path(__file__).parents[2] / 'benchmarks/rigs/map_pendulum'


@pytest.fixture
def passive(tmp_path: Path) -> Path:
    """The rig with no actuator instead of one that can give nothing."""
    folder = tmp_path / 'passive'
    shutil.copytree(DRIVEN, folder)
    text = (folder / 'robot.yaml').read_text()
    with_motor = 'actuators:\n  pivot:\n    limit: {value: 0, unit: N m}\n'
    assert with_motor in text
    (folder / 'robot.yaml').write_text(text.replace(with_motor, 'actuators: {}\n'))
    return folder


@pytest.mark.parametrize('name', [None, 'viscous_friction', 'measurement_delay'])
def test_it_swings_as_one_whose_motor_gives_nothing(name, passive):
    states = []
    for folder in (DRIVEN, passive):
        robot = load_robot(folder)
        values = {'viscous_friction': {'b': 1e-3}, 'measurement_delay': {'delay': 0.01}}
        placed = (place(robot, name, 'all', **values[name]),) if name else ()
        model, inputs = Model(robot, effects=placed), np.zeros(len(robot.actuators))
        state = model.start()
        for _ in range(20):
            state = model.step(state, inputs, 0.01)
        states.append(np.concatenate(model.sense(state)))
    assert states[0] == pytest.approx(states[1], abs=1e-12)


@pytest.mark.parametrize('motor', [True, False])
def test_leo_next_has_no_run_for_it(motor, passive, tmp_path, capsys):
    folder = DRIVEN if motor else passive
    bag(tmp_path / 'bag', record(load_robot(DRIVEN), seconds=2))
    argv = ['next', str(tmp_path / 'bag'), '--model', str(folder), '-o', str(tmp_path / 'n.csv')]
    assert main(argv) == 2
    assert 'has no motors' in capsys.readouterr().err
