# SPDX-License-Identifier: Apache-2.0
"""Values that no robot of this size has are warned of, and taken all the same."""

import pytest

from leo_diffmodel.add.plausible import implausible
from leo_msgs_py.cli import main
from leo_sim.effects import place
from leo_sim.effects.base import Effect, Parameter
from leo_sim.model import Model


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        ('coulomb_friction:pivot c=1e9', r'coulomb_friction.c: 1e+09 is outside 0 to 0.0227 N m,'),
        ('voltage_scale k=50', 'voltage_scale.k: 50 is outside 0.2 to 5,'),
        ('coulomb_friction:pivot c=0.01', ''),
        ('torque_ripple:pivot a=0.001 n=5 phase=2', ''),
        ('voltage_limit:pivot v=1', ''),
    ],
)
def test_a_value_far_out_is_one_line(tmp_path, capsys, words, said):
    new = tmp_path / 'new.yaml'
    assert main(['add', 'pendulum', *words.split(), '-o', str(new)]) == 0 and new.is_file()
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == bool(said) and said in ''.join(lines)


def test_limits_of_a_model_say_what_is_plausible():
    model = Model('pendulum')
    friction = place(model.robot, 'coulomb_friction', 'pivot', c=0.1)
    assert len([*implausible(model, [friction])]) == 1
    wider = model.changed(limits={'coulomb_friction.c': (0.0, 1.0)})
    assert [*implausible(wider, [friction])] == []


def test_a_unit_whose_size_nobody_knows_is_left_alone():
    class Warm(Effect):
        name, family, hook = 'warm', 'heat', 'torque'
        parameters = (Parameter('T', 'K', low=0.0),)

        def torque(self, p, q, dq, motor, load):
            return -p['T'] * dq

    model = Model('pendulum')
    assert [*implausible(model, [place(model.robot, Warm(), 'pivot', T=300.0)])] == []
