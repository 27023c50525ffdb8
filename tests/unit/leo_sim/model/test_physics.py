# SPDX-License-Identifier: Apache-2.0
"""What a model is made of, kept with what is learned on it."""

from dataclasses import replace
import json

import pytest

from leo_sim.description.robot import load_robot
from leo_sim.effects import place, read_effect
from leo_sim.model import load_model, Model, save_model
from leo_sim.model.physics import differing, of_model, of_robot

PENDULUM = load_robot('pendulum')
MODEL = Model(PENDULUM)
DRAG = place(PENDULUM, 'viscous_friction', 'pivot', b=1e-4)


@pytest.mark.parametrize(
    ('other', 'said'),
    [
        (Model('torque_pendulum'), r'another robot (pendulum, here torque_pendulum)'),
        (Model(replace(PENDULUM, input='torque')), 'another input (V, here N m)'),
        (
            Model(replace(PENDULUM, control_period=0.01)),
            'another control period (0.05 s, here 0.01 s)',
        ),
        (
            MODEL.changed(effects=[DRAG]),
            'another list of effects (none, here viscous_friction at pivot b=0.0001)',
        ),
        (
            MODEL.changed(constants={'links.bob.mass': 0.12}),
            'another links.bob.mass (0.055 kg, here 0.12 kg)',
        ),
        (Model(replace(PENDULUM, urdf='<robot/>')), 'another description (hash)'),
    ],
)
def test_the_first_thing_that_differs_is_named(other, said):
    assert differing(of_model(MODEL), of_model(other)).startswith(said)


def test_another_law_by_the_same_name_is_named(tmp_path):
    first, second = (tmp_path / name / 'drag.py' for name in ('first', 'second'))
    for path, power in ((first, 3), (second, 5)):
        path.parent.mkdir()
        path.write_text(
            'from leo_sim.effects import Effect, Parameter\n\n\n'
            'class Drag(Effect):\n'
            "    name, hook, family = 'drag', 'torque', 'loss'\n"
            "    parameters = (Parameter('c', 'N m', low=0.0),)\n\n"
            '    def torque(self, p, q, dq, motor, load):\n'
            f"        return -p['c'] * dq**{power}\n"
        )
    laws = map(read_effect, (first, second))
    one, other = (MODEL.changed(effects=[place(PENDULUM, law, 'pivot', c=1e-4)]) for law in laws)
    assert differing(of_model(one), of_model(other)).startswith('another file of drag (hash) (')
    assert differing(of_model(one), of_model(one)) == ''


def test_what_does_not_move_it_otherwise_is_no_difference(tmp_path):
    made = MODEL.changed(effects=[DRAG], constants={'links.bob.mass': 0.1 + 0.2})
    kept = json.loads(json.dumps(of_model(made)))
    again = load_model(save_model(tmp_path / 'model.yaml', made, [{'added': 'drag'}]))
    assert kept == of_model(again) == of_model(again.changed(engine='rigid'))


def test_what_an_earlier_version_did_not_keep_is_not_asked_for():
    assert differing({}, of_model(MODEL)) == differing({'robot': 'pendulum'}, of_robot(PENDULUM))
    assert differing({'constants': {}}, of_model(MODEL)) == ''
