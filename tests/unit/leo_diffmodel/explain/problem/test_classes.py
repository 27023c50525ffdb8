# SPDX-License-Identifier: Apache-2.0
"""What is called the same thing is the same in data; with the condition off it is not."""

from dataclasses import replace
import itertools

import numpy as np
import pytest
from tests.robots import CART
from tests.searched import among
from tests.simulate import PENDULUM, POSITION, record, steps, TORQUE

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.scan import Scanner
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.problem.candidates import uncertain
from leo_diffmodel.explain.problem.classes import CLASSES, Facts, pair_note, why_same
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.explain.problem.sizes import scales_of
from leo_sim.description.robot import Constant, load_robot, Robot
from leo_sim.effects import EFFECTS, place
from leo_sim.model import Model
from leo_sim.model.batch import rollout

SERVO, ARM = load_robot('servo_pendulum'), load_robot('double_pendulum')
CONSTANT = 'actuators.pivot.torque_constant'
GAIN = 'actuators.pivot.position_gain'
MOTOR = CONSTANT, 'actuators.pivot.resistance', 'actuators.pivot.rotor_inertia'
UNSURE = PENDULUM.with_constants({CONSTANT: Constant(CONSTANT, 0.0536, 'N m/A', (0.03, 0.08))})
GOALS = POSITION.with_constants({p: replace(POSITION.constants[p], uncertain=None) for p in MOTOR})
BANGED = replace(PENDULUM)  # by all that it has, one way or the other
QUICK = GOALS.with_constants({GAIN: Constant(GAIN, 4.0, '1/rad')})  # it gives all it has
DELAYS = ('command_delay', 'measurement_delay')
BRAKES = ('viscous_friction', 'back_emf_scale')
INERTIAS = ('armature', 'link_inertia')
SCALES = ('torque_scale', 'voltage_scale')
TURNED = ('encoder_offset', 'external_force', 'link_com', 'torque_ripple')

# Members, and one truth that every one of them explains, where the class holds.
PROOFS = [
    (BRAKES, PENDULUM, ('back_emf_scale', 'pivot', {'k': 1.5})),
    (BRAKES, PENDULUM, ('viscous_friction', 'pivot', {'b': 1e-4})),
    (DELAYS, TORQUE, ('measurement_delay', 'pivot', {'delay': 0.013})),
    (DELAYS, ARM, ('measurement_delay', 'all', {'delay': 0.013})),
    (INERTIAS, PENDULUM, ('armature', 'pivot', {'J': 3e-5})),
    (INERTIAS, TORQUE, ('link_inertia', 'bob', {'I': 0.03})),
    (INERTIAS, ARM, ('link_inertia', 'upper', {'I': 0.02})),
    (SCALES, TORQUE, ('torque_scale', 'pivot', {'k': 0.8})),
    (SCALES, ARM, ('torque_scale', 'elbow', {'k': 0.8})),
    (('back_emf_scale', *SCALES), UNSURE, ('torque_scale', 'pivot', {'k': 0.8})),
    ((*BRAKES, *SCALES), UNSURE, ('viscous_friction', 'pivot', {'b': 1e-4})),
    (TURNED, PENDULUM, ('encoder_offset', 'pivot', {'o': 0.05})),
    (TURNED, TORQUE, ('encoder_offset', 'pivot', {'o': -0.08})),
    (('encoder_offset', 'gravity'), ARM, ('encoder_offset', 'shoulder', {'o': 0.05})),
    (('external_force', 'torque_ripple'), ARM, ('external_force', 'upper', {'x': 0.5, 'z': 0.2})),
    (('supply_sag', 'torque_scale'), BANGED, ('supply_sag', 'pivot', {'R': 2.0})),
    (('servo_stiffness', 'voltage_scale'), GOALS, ('servo_stiffness', 'pivot', {'k': 0.7})),
    (('servo_damping', *BRAKES), GOALS, ('servo_damping', 'pivot', {'d': 0.02})),
    (('bias_torque', 'external_force'), CART, ('bias_torque', 'rail', {'t': 0.5})),
]


def thing(robot: Robot, name: str, near: str) -> tuple[str, str]:
    """An effect and its place: at a joint, at the link that it moves, or at all."""
    places = EFFECTS[name].places(robot)
    joint = {j.child: j.name for j in robot.joints}.get(near, near)
    links = {j.name: j.child for j in robot.joints}
    if near == 'all' or EFFECTS[name].undivided:
        return name, 'all' if len(places) > 1 else places[0]
    return name, joint if joint in places else links[joint]


def candidate(robot: Robot, name: str, where: str) -> Candidate:
    places = EFFECTS[name].places(robot) if where == 'all' else (where,)
    return Candidate(EFFECTS[name], where, EFFECTS[name].parameters_for(robot, places))


def driven(robot: Robot, *effects, enabled=None) -> Recording:
    """Ten seconds of random steps at every joint, small enough not to whirl."""
    inputs = np.hstack([steps(robot, 10, seed) for seed in range(8, 8 + len(robot.actuators))])
    inputs *= {'double_pendulum': 0.4, 'cart': 0.1, 'xl330_pendulum': 0.3}.get(robot.name, 1.0)
    inputs = robot.limits * np.sign(inputs) if robot is BANGED else inputs
    return record(robot, *effects, inputs=inputs, seed=8, enabled=enabled)


def gains(data: Recording, robot: Robot, things) -> list[float]:
    """Nats that each effect gains on all windows, constants refitted."""
    model = Model(robot)
    problem = pose([data], [], model).problem
    null = fit(problem, Hypothesis(constants=uncertain(model)))
    scanner = Scanner(problem, null, scales_of(model, problem.windows))
    found = []
    for name, where in things:
        one = candidate(robot, name, where)
        best = fit(problem, null.hypothesis.with_candidate(one), scanner.scan(one).theta)
        found.append(float((null.loss - best.loss).sum()))
    return found


@pytest.mark.parametrize(
    ('members', 'robot', 'truth'), PROOFS, ids=[f'{t[0]}-{t[1]}-{r.name}' for _, r, t in PROOFS]
)
def test_members_leave_the_same_residual(members, robot, truth):
    name, where, values = truth
    things = [thing(robot, member, where) for member in members]
    data = driven(robot, place(robot, name, where, **values))
    found = gains(data, robot, things)
    assert min(found) > 50
    assert max(found) - min(found) < max(1.5, 1e-3 * max(found))
    facts = Facts.of(robot, [data])
    assert all(why_same(*pair, facts) for pair in itertools.combinations(things, 2))


def test_every_class_is_proved():
    assert {c.names for c in CLASSES} <= {frozenset(members) for members, _, _ in PROOFS}


@pytest.mark.parametrize(
    ('robot', 'truth', 'other'),
    [
        (ARM, ('armature', 'elbow', {'J': 0.01}), ('link_inertia', 'lower')),
        (ARM, ('external_force', 'lower', {'x': 0.5}), ('torque_ripple', 'elbow')),
        (ARM, ('encoder_offset', 'elbow', {'o': 0.05}), ('gravity', 'all')),
        (ARM, ('command_delay', 'elbow', {'delay': 0.013}), ('measurement_delay', 'all')),
        (PENDULUM, ('torque_scale', 'pivot', {'k': 0.8}), ('voltage_scale', 'pivot')),
        (PENDULUM, ('supply_sag', 'pivot', {'R': 9.0}), ('torque_scale', 'pivot')),
        (TORQUE, ('bias_torque', 'pivot', {'t': 0.3}), ('external_force', 'bob')),
        (QUICK, ('servo_stiffness', 'pivot', {'k': 0.7}), ('voltage_scale', 'pivot')),
    ],
)
def test_elsewhere_they_are_not_the_same(robot, truth, other):
    name, where, values = truth
    data = driven(robot, place(robot, name, where, **values))
    mine, others = gains(data, robot, [(name, where), other])
    assert mine > others + 20
    assert why_same((name, where), other, Facts.of(robot, [data])) is None


def off_at_times() -> np.ndarray:
    on = np.ones((1000, 1), dtype=bool)
    for start in range(50, 1000, 120):
        on[start : start + 60] = False
    return on


def test_a_motor_that_is_free_at_times_tells_back_emf_from_friction(monkeypatch):
    among(monkeypatch, Model(PENDULUM), 'back_emf_scale', 'viscous_friction', 'coulomb_friction')
    effect = place(PENDULUM, 'viscous_friction', 'pivot', b=1e-4)
    data = driven(PENDULUM, effect, enabled=off_at_times())
    things = [('viscous_friction', 'pivot'), ('back_emf_scale', 'pivot')]
    mine, other = gains(data, PENDULUM, things)
    assert mine > other + 20
    assert why_same(*things, Facts(PENDULUM, ever_free=True)) is None
    answer = explain([data], Model(PENDULUM))
    assert (answer.verdict, answer.effects[0]['name']) == ('named', 'viscous_friction')
    assert not any(r['same_thing'] for r in answer.effects[0]['confusable_with'])


def test_friction_shows_in_a_servo_of_unknown_motor_only_where_it_is_free():
    effect = place(SERVO, 'viscous_friction', 'pivot', b=5e-3)
    things = [('viscous_friction', 'pivot')]
    assert gains(driven(SERVO, effect, enabled=off_at_times()), SERVO, things)[0] > 100
    assert gains(driven(SERVO, effect), SERVO, things)[0] < 10


def test_a_motor_that_is_free_at_times_tells_a_late_state_from_a_late_command():
    effect = place(SERVO, 'measurement_delay', 'pivot', delay=0.013)
    things = [(name, 'pivot') for name in DELAYS]
    late_command, late_state = gains(driven(SERVO, effect, enabled=off_at_times()), SERVO, things)
    assert late_state > late_command + 20
    assert why_same(*things, Facts(SERVO, ever_free=True)) is None


def test_a_downward_force_is_a_heavier_link_with_less_inertia():
    mass, arm = 0.035, 0.042
    pair = [
        place(PENDULUM, 'link_mass', 'bob', m=mass),
        place(PENDULUM, 'link_inertia', 'bob', I=-mass * arm**2),
    ]
    force = place(PENDULUM, 'external_force', 'bob', z=-9.81 * mass)
    bags = [record(PENDULUM, *effects, noise=(0.0, 0.0)) for effects in (pair, [force])]
    (one,), (other,) = (bag.episodes for bag in bags)
    np.testing.assert_allclose(one.q, other.q, atol=1e-6)
    note = pair_note([candidate(PENDULUM, 'external_force', 'bob')], Facts(PENDULUM, False))
    assert note is not None and 'link_mass with a negative link_inertia' in note


def test_links_that_are_welded_together_turn_as_one():
    leo, name = load_robot('leo'), 'link_inertia'
    inputs = np.random.default_rng(0).uniform(-4, 4, (1, 15, 6))
    q = [moved(place(leo, name, link, I=0.005), inputs) for link in ('torso', 'arm', 'left_thigh')]
    np.testing.assert_allclose(q[0], q[1], atol=1e-9)
    assert np.abs(q[0] - q[2]).max() > 0.01
    facts = Facts(leo, ever_free=False)
    assert why_same((name, 'torso'), (name, 'arm'), facts)
    assert why_same((name, 'torso'), (name, 'left_thigh'), facts) is None
    assert why_same(('link_mass', 'torso'), ('link_mass', 'arm'), facts) is None


def moved(effect, inputs) -> np.ndarray:
    """How LEO moves with an effect, angles (1, K+1, J)."""
    model = Model(load_robot('leo'), [effect], engine='rigid', scheme='search')
    start = model.start('random', np.random.default_rng(0))
    return rollout(model, start.q[None], start.dq[None], inputs, model.robot.control_period)[0]
