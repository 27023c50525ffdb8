# SPDX-License-Identifier: Apache-2.0
"""Safety: what reaches a motor is bounded, fresh, and 0 while stopped."""

import re
import shutil

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.drivers.safety import BadCommand, Safety

LIMITS = (7.4, 3.0)
finite = st.floats(-1e6, 1e6)


def test_zero_before_the_first_command():
    assert Safety(LIMITS).output(0.0).tolist() == [0.0, 0.0]


@given(st.lists(st.tuples(finite, finite, st.floats(0.0, 0.05))), st.floats(0.0, 500.0))
def test_output_stays_inside_limits_and_slew(commands, slew):
    safety = Safety(LIMITS, timeout=0.0, slew=slew)
    now, before = 0.0, safety.output(0.0)
    for first, second, wait in commands:
        safety.accept((first, second), now)
        now += wait
        output = safety.output(now)
        assert np.all(np.abs(output) <= LIMITS)
        if slew:
            assert np.all(np.abs(output - before) <= slew * wait + 1e-9)
        before = output


@given(finite, finite)
def test_a_command_inside_the_limits_passes_unchanged(first, second):
    safety = Safety(LIMITS)
    safety.accept((first, second), 1.0)
    assert safety.output(1.0).tolist() == np.clip((first, second), (-7.4, -3.0), LIMITS).tolist()


def test_old_command_is_dropped_once_and_a_new_one_ends_it():
    safety = Safety(LIMITS, timeout=0.1)
    safety.accept((1.0, 1.0), 0.0)
    assert safety.output(0.1).tolist() == [1.0, 1.0]
    for now in (0.11, 0.2, 5.0):
        assert safety.output(now).tolist() == [0.0, 0.0]
    assert safety.timed_out and safety.timeouts == 1
    safety.accept((2.0, 2.0), 6.0)
    assert safety.output(6.0).tolist() == [2.0, 2.0] and not safety.timed_out


def test_timeout_zero_never_drops():
    safety = Safety(LIMITS, timeout=0.0)
    safety.accept((1.0, 1.0), 0.0)
    assert safety.output(1e9).tolist() == [1.0, 1.0] and safety.timeouts == 0


@given(st.lists(st.tuples(finite, finite)))
def test_e_stop_holds_zero_until_its_own_reset(commands):
    safety = Safety(LIMITS, timeout=0.0)
    safety.accept((1.0, 1.0), 0.0)
    safety.e_stop()
    for command in commands:
        safety.accept(command, 0.0)
        assert safety.output(0.0).tolist() == [0.0, 0.0]
    safety.e_stop_reset()
    assert safety.output(0.0).tolist() == [0.0, 0.0], 'commands from before the reset are gone'
    safety.accept((2.0, 2.0), 0.0)
    assert safety.output(0.0).tolist() == [2.0, 2.0]


@pytest.mark.parametrize(
    'values, said',
    [
        ((1.0,), 'it has 1 values, the robot has 2 actuators'),
        ((), 'it has 0 values, the robot has 2 actuators'),
        ((1.0, float('nan')), 'not finite'),
        ((float('inf'), 0.0), 'not finite'),
    ],
)
def test_bad_command_is_refused_and_the_one_before_holds(values, said):
    safety = Safety(LIMITS)
    safety.accept((1.0, -1.0), 0.0)
    with pytest.raises(BadCommand, match=said):
        safety.accept(values, 0.0)
    assert safety.output(0.0).tolist() == [1.0, -1.0] and safety.rejected == 1


@pytest.mark.parametrize('options', [{'timeout': -1.0}, {'slew': float('nan')}])
def test_impossible_settings_are_refused(options):
    with pytest.raises(UserError, match='give 0'):
        Safety(LIMITS, **options)


@pytest.mark.parametrize('limit', [0.0, -7.4, float('nan'), float('inf')])
def test_a_limit_that_is_none_is_refused(limit):
    with pytest.raises(UserError, match='above 0'):
        Safety([3.0, limit])


def test_a_negative_limit_in_robot_yaml_is_one_line(tmp_path):
    folder = shutil.copytree(load_robot('pendulum').folder, tmp_path / 'mine')
    path = folder / 'robot.yaml'
    path.chmod(0o644)
    text, count = re.subn(r'limit: \{value: 3', 'limit: {value: -3', path.read_text())
    assert count == 1
    path.write_text(text)
    with pytest.raises(UserError, match=r'actuators\.pivot\.limit: -3 V is not within'):
        load_robot(folder)


@given(st.lists(st.tuples(finite, finite), min_size=1), st.booleans())
def test_who_is_blind_or_stopped_drives_nothing(commands, e_stopped):
    safety = Safety(LIMITS, timeout=0.0)
    for command in commands:
        safety.accept(command, 0.0)
        if e_stopped:
            safety.e_stop()
        assert not safety.output(0.0, blind=not e_stopped).any()
        assert safety.stops(0.0) == e_stopped
