# SPDX-License-Identifier: Apache-2.0
"""What each parameter does in its law: declared in the catalogue, told for users' effects."""

from dataclasses import replace

import pytest

from leo_diffmodel.explain.estimate.ground_scan import is_straight
from leo_diffmodel.explain.estimate.scan import stretch_limits
from leo_diffmodel.explain.problem.hypothesis import amplitude_indices, Candidate
from leo_diffmodel.explain.settings import SETTINGS
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.effects import EFFECTS, get_effect
from leo_sim.effects.base import with_roles
from leo_sim.effects.parameter import ROLES

ROBOTS = [load_robot(name) for name in ('pendulum', 'torque_pendulum', 'leo')]
PLACED = [
    pytest.param(e, e.parameters_for(r, e.places(r)), id=f'{e.name}-{r.name}')
    for r in ROBOTS
    for e in EFFECTS.values()
    if e.applies(r)
]
UNTOLD = 'quadratic_load_friction', 'voltage_push', 'payload', 'late_payload', 'smooth_friction'
"""No unit tells that a square is an amplitude too, that volts are added and not cut off, that a
length is a place, or that a torque without stiction is dry friction."""


@pytest.mark.parametrize(('effect', 'parameters'), PLACED)
def test_every_parameter_of_the_catalogue_declares_its_role(effect, parameters):
    assert all(p.role in ROLES for p in parameters)
    assert parameters[0].scales
    assert with_roles(effect, parameters) == parameters


@pytest.mark.parametrize(
    ('effect', 'parameters'), [case for case in PLACED if case.values[0].name not in UNTOLD]
)
def test_without_roles_an_effect_is_scanned_as_before(effect, parameters):
    """A user's effect that declares none is read by its units as the catalogue declares."""
    bare = tuple(replace(p, role='', linear=True) for p in parameters)
    told = with_roles(effect, bare)
    declared, guessed = (Candidate(effect, 'all', ps) for ps in (parameters, told))
    assert amplitude_indices(told) == amplitude_indices(parameters)
    assert stretch_limits(guessed, SETTINGS.grids) == stretch_limits(declared, SETTINGS.grids)
    assert is_straight(guessed) == is_straight(declared)
    assert [p.turns for p in told] == [p.turns for p in parameters]


def test_a_role_that_is_none_is_refused(tmp_path):
    file = tmp_path / 'hose.py'
    file.write_text(
        'from leo_sim.effects import Effect, Parameter\n'
        'class Hose(Effect):\n'
        "    name, family, hook = 'hose', 'x', 'torque'\n"
        "    parameters = (Parameter('k', 'N m/rad', role='strength'),)\n"
        '    def torque(self, p, q, dq, motor, load):\n'
        "        return -p['k'] * q\n"
    )
    with pytest.raises(UserError, match=r'role .strength.; there are amplitude, threshold'):
        get_effect(str(file))
