# SPDX-License-Identifier: Apache-2.0
"""What is called the same thing is the same in data; with the condition off it is not."""

import itertools

import numpy as np
import pytest
from tests.first_round import first_search
from tests.simulate import PENDULUM, record, TORQUE

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.explain.classes import CLASSES, Facts, pair_note, same_thing
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.hypothesis import Candidate
from leo_sim.effects import EFFECTS, place
from leo_sim.model import Model
from leo_sim.robot import Robot

# One truth that every member of the class explains, on every robot where the class holds.
PROOFS = [
    ({'viscous_friction', 'back_emf_scale'}, PENDULUM, ('back_emf_scale', {'k': 1.5})),
    ({'viscous_friction', 'back_emf_scale'}, PENDULUM, ('viscous_friction', {'b': 1e-4})),
    ({'armature', 'link_inertia'}, PENDULUM, ('armature', {'J': 3e-5})),
    ({'armature', 'link_inertia'}, TORQUE, ('link_inertia', {'I': 0.03})),
    ({'torque_scale', 'voltage_scale'}, TORQUE, ('torque_scale', {'k': 0.8})),
    ({'encoder_offset', 'external_force', 'link_com', 'torque_ripple'}, PENDULUM,
     ('encoder_offset', {'o': 0.05})),
    ({'encoder_offset', 'external_force', 'link_com', 'torque_ripple'}, TORQUE,
     ('encoder_offset', {'o': -0.08})),
]  # fmt: skip


def candidate(robot: Robot, name: str) -> Candidate:
    (where, *_) = EFFECTS[name].places(robot)
    return Candidate(EFFECTS[name], where, EFFECTS[name].parameters_for(robot, (where,)))


def gains(data: Recording, robot: Robot) -> dict[str, float]:
    """Nats that each refined candidate gains on all windows."""
    step = first_search([data], Model(robot)).rounds[0]
    return {
        s.candidate.effect.name: float((step.null.loss - s.fit.loss).sum())
        for s in step.scored
        if s.fit is not None
    }


@pytest.mark.parametrize(
    ('members', 'robot', 'truth'), PROOFS, ids=[f'{t[0]}-{r.name}' for _, r, t in PROOFS]
)
def test_members_leave_the_same_residual(members, robot, truth):
    name, values = truth
    effect = place(robot, name, EFFECTS[name].places(robot)[0], **values)
    found = gains(record(robot, effect, seconds=10, seed=8), robot)
    assert members <= found.keys()
    of_class = [found[m] for m in sorted(members)]
    assert min(of_class) > 100
    assert max(of_class) - min(of_class) < max(1.5, 1e-3 * max(of_class))
    facts = Facts(robot, ever_free=False)
    for a, b in itertools.combinations(sorted(members), 2):
        assert same_thing(candidate(robot, a), candidate(robot, b), facts)


def test_every_class_is_proved():
    proved = [members for members, _, _ in PROOFS]
    for entry in CLASSES:
        known = set(entry.names & EFFECTS.keys())
        assert len(known) < 2 or known in proved, entry


def test_a_motor_that_is_free_at_times_tells_back_emf_from_friction():
    on = np.ones((1000, 1), dtype=bool)
    for start in range(50, 1000, 120):
        on[start : start + 60] = False
    effect = place(PENDULUM, 'viscous_friction', 'pivot', b=1e-4)
    data = record(PENDULUM, effect, seconds=10, seed=8, enabled=on)
    found = gains(data, PENDULUM)
    assert found['viscous_friction'] > found.get('back_emf_scale', 0.0) + 20
    facts = Facts(PENDULUM, ever_free=True)
    names = ('viscous_friction', 'back_emf_scale')
    assert same_thing(*(candidate(PENDULUM, n) for n in names), facts) is None
    answer = explain([data], Model(PENDULUM))
    assert (answer.verdict, answer.effects[0]['name']) == ('named', 'viscous_friction')
    assert not any(r['same_thing'] for r in answer.effects[0]['confusable_with'])


def test_back_emf_tells_torque_scale_from_voltage_scale():
    found = gains(record(PENDULUM, place(PENDULUM, 'torque_scale', 'pivot', k=0.8)), PENDULUM)
    assert found['torque_scale'] > found.get('voltage_scale', 0.0) + 20
    names = ('torque_scale', 'voltage_scale')
    facts = Facts(PENDULUM, ever_free=False)
    assert same_thing(*(candidate(PENDULUM, n) for n in names), facts) is None


def test_a_downward_force_is_a_heavier_link_with_less_inertia():
    mass, arm = 0.035, 0.042
    pair = [
        place(PENDULUM, 'link_mass', 'bob', m=mass),
        place(PENDULUM, 'link_inertia', 'bob', I=-mass * arm**2),
    ]
    force = place(PENDULUM, 'external_force', 'bob', z=-9.81 * mass)
    (one,), (other,) = (
        record(PENDULUM, *effects, noise=(0.0, 0.0)).episodes for effects in (pair, [force])
    )
    np.testing.assert_allclose(one.q, other.q, atol=1e-6)
    note = pair_note([candidate(PENDULUM, 'external_force')], Facts(PENDULUM, False))
    assert note is not None and 'link_mass with a negative link_inertia' in note
