# SPDX-License-Identifier: Apache-2.0
"""Values that no robot has are left out and told; what is in another unit stays."""

from pathlib import Path

import numpy as np
import pytest
from tests.robots import CART
from tests.simulate import PENDULUM

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.bags.impossible import input_channels
from leo_diffmodel.bags.recording import read_bag
from leo_msgs_py.cli import main
from leo_msgs_py.errors import UserError

pytestmark = pytest.mark.filterwarnings('error')
COUNT = 400


def columns() -> dict[str, np.ndarray]:
    """A swing at 100 Hz; the motor is driven in a twentieth of the time."""
    t = 0.01 * np.arange(COUNT)
    volts = np.where(t > 3.8, 2.0 * np.sign(np.sin(20 * t)), 0.0)
    return {'q': 3 + np.sin(t), 'dq': np.cos(t), 'effort': 0.01 * np.cos(t), 'volts': volts}


def write(folder: Path, **found: np.ndarray) -> Path:
    *measured, volts = {**columns(), **found}.values()
    inputs = {'pivot': {'voltage': volts, 'enabled': np.ones(COUNT)}}
    channels = (column[:, None] for column in measured)
    run = Run(0.01 * np.arange(COUNT), ['pivot'], *channels, inputs=inputs)
    return write_runs(folder, [run], {'robot': 'pendulum'})


def glitch(name: str, value: float) -> dict[str, np.ndarray]:
    column = columns()[name].copy()
    column[100] = value
    return {name: column}


@pytest.mark.parametrize('sign', [1, -1])
@pytest.mark.parametrize(
    ('name', 'value', 'told'),
    [
        ('q', 1e200, '1 positions of pivot beyond 3.99e+04 rad,'),
        ('q', 1e7, '1 positions of pivot beyond 3.99e+04 rad,'),
        ('dq', 1e200, '1 velocities of pivot beyond 1e+04 rad/s,'),
        ('dq', 1e5, '1 velocities of pivot beyond 1e+04 rad/s,'),
        ('volts', 1e200, '1 inputs of pivot beyond 30 V,'),
        ('volts', 1e5, '1 inputs of pivot beyond 30 V,'),
        ('volts', 1e3, '1 inputs of pivot beyond 30 V,'),
        ('effort', 1e200, '1 efforts of pivot beyond 0.992 N m,'),
    ],
)
def test_one_value_that_no_robot_has_is_left_out_and_told(name, value, told, sign, tmp_path):
    recording = read_bag(write(tmp_path / 'bag', **glitch(name, sign * value)), PENDULUM)
    (warning,) = recording.warnings
    assert told in warning and 'left out' in warning
    (episode,) = recording.episodes
    assert len(episode.t) == COUNT - (name in ('q', 'dq'))
    assert abs(episode.q).max() < 5 and abs(episode.dq).max() < 2
    assert abs(episode.inputs).max() == 2.0
    assert np.isnan(episode.effort).sum() == (name == 'effort')
    assert np.nanmax(abs(episode.effort)) <= 0.01


@pytest.mark.parametrize(
    ('name', 'unit'),
    [
        *(('q', 180 / np.pi), ('q', 4096 / (2 * np.pi)), ('dq', 180 / np.pi), ('dq', 1000.0)),
        *(('dq', 60 / (2 * np.pi)), ('effort', 1000.0)),
    ],
)
def test_a_channel_in_another_unit_stays(name, unit, tmp_path):
    recording = read_bag(write(tmp_path / 'bag', **{name: unit * columns()[name]}), PENDULUM)
    assert not any('no robot' in warning for warning in recording.warnings)
    assert sum(len(e.t) for e in recording.episodes) == COUNT


def test_volts_logged_in_millivolts_stay(tmp_path):
    volts = 1000 * np.sign(np.sin(np.arange(COUNT)))
    recording = read_bag(write(tmp_path / 'bag', volts=volts), PENDULUM)
    assert recording.warnings == () and abs(recording.episodes[0].inputs).max() == 1000


def test_what_motors_and_hands_do_stays(tmp_path):
    found = {**glitch('dq', 5000.0), **glitch('volts', 30.0)}
    recording = read_bag(write(tmp_path / 'bag', **found), PENDULUM)
    assert not any('no robot' in warning for warning in recording.warnings)


def test_a_channel_that_no_unit_explains_is_one_line(tmp_path):
    bag = write(tmp_path / 'bag', dq=np.full(COUNT, 1e200))
    with pytest.raises(UserError, match=r'no joint state is left: 400 velocities of pivot'):
        read_bag(bag, PENDULUM)


def test_compare_goes_on_without_them(tmp_path, capsys):
    found = {**glitch('dq', 1e200), **glitch('volts', 1e5)}
    assert main(['compare', str(write(tmp_path / 'bag', **found)), '--model', 'pendulum']) == 0
    out, err = capsys.readouterr()
    assert 'nan' not in out
    told = [line for line in err.splitlines() if line.startswith('warning: ')]
    assert len(told) == 2 and all('which no robot has' in line for line in told)


def test_what_pushes_a_slide_is_told_in_its_units():
    units = {of: [c.unit for c in input_channels(CART, of)] for of in ('torque', 'position')}
    assert units == {'torque': ['N'], 'position': ['m']}
