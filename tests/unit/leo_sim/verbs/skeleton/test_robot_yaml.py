# SPDX-License-Identifier: Apache-2.0
"""Actuators of slides are written and printed in m and N, those of hinges in rad and N m."""

import pytest
from tests.robots import CLAW, SLIDES

from leo_msgs_py.cli import main
from leo_sim.description.robot import load_robot
from leo_sim.verbs.skeleton.folder import read_description
from leo_sim.verbs.skeleton.robot_yaml import actuators

UNITS = {
    'torque': {'limit': 'N', 'rotor_inertia': 'kg'},
    'voltage': {'limit': 'V', 'torque_constant': 'N/A', 'rotor_inertia': 'kg'},
    'position': {'limit': 'm', 'torque_constant': 'N/A', 'position_gain': '1/m'},
}


def initiated(folder, text, kind):
    source, made = folder / 'g.urdf', folder / 'g'
    source.write_text(text)
    assert main(['robot', 'init', str(source), '-o', str(made), '--input', kind]) == 0
    return load_robot(made)


@pytest.mark.parametrize('kind', UNITS)
def test_a_slide_has_units_of_sliding(tmp_path, capsys, kind):
    robot = initiated(tmp_path, SLIDES, kind)
    for figure, unit in UNITS[kind].items():
        assert robot.constants[f'actuators.left.{figure}'].unit == unit
    out, text = capsys.readouterr().out, (tmp_path / 'g' / 'robot.yaml').read_text()
    assert '  left: from 0 to 0.05 m, starts at 0 m, takes up to ' in out
    assert 'right: moves with left, 1 times as far' in out
    turning = [line for line in text.splitlines() if 'N m' in line or 'rad' in line]
    assert [line for line in turning if not line.startswith('#')] == []


def test_figures_of_a_slide_are_from_its_force_and_speed(tmp_path):
    (a,) = initiated(tmp_path, SLIDES, 'voltage').actuators
    assert a.torque_constant * a.limit / a.resistance == pytest.approx(10, rel=0.01)
    assert a.limit / a.torque_constant == pytest.approx(1, rel=0.01)


def test_a_hinge_keeps_those_of_turning(tmp_path, capsys):
    assert initiated(tmp_path, CLAW, 'torque').constants['actuators.left.limit'].unit == 'N m'
    out = capsys.readouterr().out
    assert '  left: from -2.5 to 2.5 rad, starts at 0 rad, takes up to 0.3 N m' in out
    assert '  bend: moves with left, -0.5 times as far' in out


def test_without_an_effort_a_slide_is_taken_to_hold_twice_its_weight(tmp_path):
    (tmp_path / 'g.urdf').write_text(SLIDES.replace('effort="10"', ''))
    description = read_description(tmp_path / 'g.urdf')
    limit = actuators(description, {'left': 2.0}, 'torque', {'left'})['left']['limit']
    assert (limit.value, limit.unit, limit.open) == (4.0, 'N', True)
