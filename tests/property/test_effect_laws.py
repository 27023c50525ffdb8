# SPDX-License-Identifier: Apache-2.0
"""Laws of the effects for any sensible numbers."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from leo_sim.description.robot import load_robot
from leo_sim.effects import EFFECTS, place
from leo_sim.effects.motor import Motor, voltage_motor
from leo_sim.model import Model
from leo_sim.model.batch import rollout

ROBOTS = {name: load_robot(name) for name in ('pendulum', 'torque_pendulum')}
speeds = st.floats(-30, 30)
angles = st.floats(-10, 10)
torques = st.floats(-1, 1)
sizes = st.floats(0, 1)
names = st.sampled_from(sorted(ROBOTS))
FRICTION = [name for name, effect in EFFECTS.items() if effect.family == 'friction']


@pytest.mark.parametrize('name', FRICTION)
@given(
    w=speeds, q=angles, motor=torques, load=torques, size=st.lists(sizes, min_size=3, max_size=3)
)
def test_friction_opposes_motion(name, w, q, motor, load, size):
    effect = EFFECTS[name]
    p = dict(zip((p.name for p in effect.parameters), size, strict=False))
    speed = np.array([w])
    driving = Motor(np.array([motor]), 0.0)
    torque = effect.torque(p, np.array([q]), speed, driving, np.array([load]))
    assert torque[0] * w <= 0


def energy(q, dq):
    """Of the torque pendulum, J."""
    return 0.5 * 0.149519217 * dq**2 - 2.996955 * np.cos(q)


@pytest.mark.parametrize('name', FRICTION)
@given(q=st.floats(-3, 3), w=st.floats(-6, 6), size=st.floats(1e-3, 0.3))
@settings(max_examples=15, deadline=None)
def test_friction_creates_no_energy(name, q, w, size):
    robot = ROBOTS['torque_pendulum']
    first, *others = EFFECTS[name].parameters
    values = {first.name: size} | {p.name: size for p in others}
    rubbing, bare = [place(robot, name, 'all', **values)], []
    models = (Model(robot, effects, integration_step=0.002) for effects in (rubbing, bare))
    still = np.zeros((1, 60, 1))
    kept, ideal = (energy(*rollout(model, [[q]], [[w]], still, 0.01)) for model in models)
    wobble = np.ptp(ideal) + 1e-9
    assert np.all(np.diff(kept[0, :, 0]) <= 2 * wobble)
    assert kept[0, -1, 0] <= kept[0, 0, 0] + 2 * wobble


@given(torque=st.floats(-0.99, 0.99), level=st.floats(0.01, 0.2))
@settings(max_examples=25, deadline=None)
def test_coulomb_friction_holds_still_below_its_level(torque, level):
    robot = ROBOTS['torque_pendulum']
    friction = place(robot, 'coulomb_friction', 'pivot', c=level)
    model = Model(robot, [friction], engine='rigid')
    after = model.step(model.state_from([0.0], [0.0]), [torque * level], 0.1)
    assert [after.q[0], after.dq[0]] == pytest.approx([0.0, 0.0], abs=1e-15)
    pushed = model.step(model.state_from([0.0], [0.0]), [1.05 * level], 0.1)
    assert pushed.dq[0] > 0


@pytest.mark.parametrize('effect', sorted(EFFECTS))
@given(name=names, q=angles, w=st.floats(-9, 9), share=st.floats(-1, 1), on=st.booleans())
@settings(max_examples=8, deadline=None)
def test_neutral_parameters_change_nothing(effect, name, q, w, share, on):
    robot = ROBOTS[name]
    if not EFFECTS[effect].applies(robot):
        return
    inputs = share * robot.limits * np.array([[1.0], [-0.5]])[None]
    tracks = [
        rollout(Model(robot, effects), [[q]], [[w]], inputs, 0.03, np.full((1, 2, 1), on))
        for effects in ((), (place(robot, effect, 'all'),))
    ]
    assert np.allclose(*tracks, rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    ('name', 'tiny'),
    [
        ('command_delay', {'delay': 1e-9}),
        ('actuator_lag', {'tau': 1e-9}),
        ('backlash', {'gap': 1e-9}),
        ('coulomb_friction', {'c': 1e-12}),
        ('voltage_deadband', {'v': 1e-9}),
    ],
)
@given(q=angles, w=st.floats(-9, 9), share=st.floats(-1, 1))
@settings(max_examples=8, deadline=None)
def test_a_tiny_effect_changes_almost_nothing(name, tiny, q, w, share):
    robot = ROBOTS['pendulum']
    inputs = share * robot.limits * np.ones((1, 2, 1))
    tracks = [
        rollout(Model(robot, effects), [[q]], [[w]], inputs, 0.03)
        for effects in ((), (place(robot, name, 'all', **tiny),))
    ]
    assert np.allclose(*(t[1] for t in tracks), atol=1e-5)


@given(u=st.floats(-12, 12), w=speeds, k=st.floats(0.01, 2), r=st.floats(0.1, 20))
def test_motor_law(u, w, k, r):
    running, free, shorted = (
        voltage_motor(v, np.array([w]), k, r, np.array([on]))
        for v, on in ((u, True), (u, False), (0.0, True))
    )
    assert running.torque[0] == pytest.approx(k * (u - k * w) / r, abs=1e-9)
    assert free.torque[0] == free.back_emf[0] == 0.0
    assert shorted.torque[0] * w <= 0


@given(u=st.floats(-12, 12), v=st.floats(0, 5))
def test_deadband_and_limit(u, v):
    dead, _ = EFFECTS['voltage_deadband'].command({'v': v}, np.array([u]), None, 0.01)
    clipped, _ = EFFECTS['voltage_limit'].command({'v': v}, np.array([u]), None, 0.01)
    assert abs(dead[0]) == pytest.approx(max(abs(u) - v, 0.0))
    assert dead[0] * u >= 0
    assert abs(clipped[0]) <= v + 1e-12


@given(delay=st.floats(0, 0.1), values=st.lists(st.floats(-3, 3), min_size=30, max_size=30))
def test_delayed_commands_keep_their_mean(delay, values):
    """What goes in comes out: the integral of a delayed pulse train is that of the train."""
    effect, h, memory, total = EFFECTS['command_delay'], 0.01, None, 0.0
    for value in values + [0.0] * 12:
        late, memory = effect.command({'delay': delay}, np.array([value]), memory, h)
        total += late[0] * h
    assert total == pytest.approx(h * sum(values), abs=1e-9)


@given(tau=st.floats(0, 0.05), u=st.floats(-3, 3))
def test_lag_is_exact_whatever_the_step(tau, u):
    lag, results = EFFECTS['actuator_lag'], []
    for count in (1, 10):
        memory, mean = None, 0.0
        for _ in range(count):
            out, memory = lag.command({'tau': tau}, np.array([u]), memory, 0.02 / count)
            mean += out[0] / count
        results.append((mean, memory[0]))
    assert results[0] == pytest.approx(results[1], abs=1e-9)
