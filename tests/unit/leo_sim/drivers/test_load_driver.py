# SPDX-License-Identifier: Apache-2.0
"""Drivers by name and by file."""

import re

import numpy as np
import pytest
from tests.places import RIG

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.drivers import load_driver
from leo_sim.drivers.base import DriverBug, DriverOptions, Haltable, NotPossible

OPTIONS = DriverOptions(load_robot('pendulum'))


def test_a_file_is_a_driver():
    driver = load_driver(str(RIG), OPTIONS)
    assert driver.info.actuators == ('pivot',) and isinstance(driver, Haltable)


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('', 'defines 0 drivers; it must define exactly one class with the methods connect'),
        (RIG.read_text() + '\n\nclass Other(Rig):\n    pass\n', 'defines 2 drivers'),
        ('import nothing_there', 'line 1: ModuleNotFoundError'),
        ('def f(:', 'line 1: SyntaxError'),
        (RIG.read_text().replace('self._lose = 0', '1 / 0'), 'ZeroDivisionError'),
        (RIG.read_text().replace('self.info =', 'self.about ='), 'has no info'),
    ],
)
def test_a_file_that_is_none_is_one_line(tmp_path, text, said):
    path = tmp_path / 'mine.py'
    path.write_text(text)
    with pytest.raises(UserError, match=said) as raised:
        load_driver(str(path), OPTIONS)
    assert str(path) in str(raised.value) and '\n' not in str(raised.value)


@pytest.mark.parametrize(
    ('method', 'body', 'said'),
    [
        ('read', 'return None', 'read returned NoneType, not JointStates'),
        ('read', "return JointStates(0, ('pivot',), [0.0, 1.0], [0.0])", r'shape \(2,\)'),
        ('read', "return JointStates(0, ('pivot',), ['a'], [0.0])", r'not \(1,\) numbers'),
        ('read', 'return self.nothing', r'line \d+: AttributeError'),
        ('write', 'return values', 'write returned ndarray, not Applied or NoneType'),
        ('halt', "raise KeyError('x')", r"line \d+: KeyError: 'x'; mend the driver"),
        ('advance', "return '0'", 'advance returned str'),
    ],
)
def test_code_that_fails_is_a_fault_with_its_place(tmp_path, method, body, said):
    path = tmp_path / 'mine.py'
    text = re.sub(rf'def {method}\(.*\):\n', rf'\g<0>        {body}\n', RIG.read_text())
    path.write_text(text)
    driver = load_driver(str(path), OPTIONS)
    given = {'write': (np.zeros(1),), 'advance': (0.1,)}.get(method, ())
    with pytest.raises(DriverBug, match=said) as raised:
        getattr(driver, method)(*given)
    assert str(path) in str(raised.value) and '\n' not in str(raised.value)


def test_errors_that_are_meant_pass(tmp_path):
    driver = load_driver(str(RIG), OPTIONS)
    with pytest.raises(NotPossible, match='by hand'):
        driver.reset()


def test_an_unknown_driver_names_the_nearest():
    with pytest.raises(UserError, match='did you mean simulated'):
        load_driver('simulate', OPTIONS)
    with pytest.raises(UserError, match='no driver file'):
        load_driver('nowhere.py', OPTIONS)
