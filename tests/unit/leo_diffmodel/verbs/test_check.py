# SPDX-License-Identifier: Apache-2.0
"""leo check as a person meets it, of joints that slide."""

import re

import pytest
from tests.robots import CART, CART_POLE
from tests.simulate import record, steps

from leo_diffmodel.check.check import Bag, check
from leo_diffmodel.verbs.check import show
from leo_msgs_py.console import Terminal
from leo_sim.model import Model

FINE = (1e-4, 1e-3)


def said(result, capsys) -> str:
    show(result, Terminal(width=200))
    return capsys.readouterr().out


@pytest.fixture(scope='module')
def both():
    run = record(CART_POLE, seconds=10, noise=FINE, inputs=steps(CART_POLE, 10, 5))
    return check([Bag(run)], Model(CART_POLE))


def test_a_robot_that_only_slides_has_no_angles_and_no_torques(capsys):
    text = said(check([Bag(record(CART, seconds=10, noise=FINE))], Model(CART)), capsys)
    assert re.search(r'rail: noise \S+ m and \S+ m/s rms', text) and 'position [m]' in text
    assert not re.search(r'\brad\b|\bN m\b|\bangle\b', text)


def test_hinges_and_slides_are_listed_by_their_units(both, capsys):
    text = said(both, capsys)
    heads = re.findall(r'position \[(\w+)\] +┃ +speed \[(\S+)\]', text)
    assert heads == [('m', 'm/s'), ('rad', 'rad/s')]
    assert re.search(r'│ rail .* N │', text) and re.search(r'hinge: noise \S+ rad and', text)


def test_sizes_of_two_units_are_no_one_range(both, capsys):
    text = said(both, capsys)
    for unit, places in (('N s/m', 1), ('N m s/rad', 1)):
        assert re.search(rf'│ viscous_friction +│ +{places} │.*│ {unit} +│', text)
