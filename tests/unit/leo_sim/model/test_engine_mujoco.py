# SPDX-License-Identifier: Apache-2.0
"""MuJoCo as an engine: the same robots, laws and ground, stepped another way."""

import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tests.models import modelled, stepped
from tests.robots import BALL

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model, State

LEO = load_robot('leo')


def run(model, state, inputs, dt):
    states = [state]
    for u in inputs:
        states.append(model.step(states[-1], u, dt))
    return states


def airborne(rng):
    q = rng.uniform([-0.5, 0, 0, -1.5, -1.5, -0.8, -0.8], [0.5, 1, 1, -0.2, -0.2, 0.8, 0.8])
    return State(np.concatenate([[0, 1], q]), rng.normal(0, 3, 9))


def test_the_ground_is_a_spring_and_a_damper():
    model = Model(BALL, engine='mujoco', integration_step=1e-4)
    start = State(np.array([0, 0.1, 0, 0.0]), np.array([0, -0.2, 0, 0]))
    states = run(model, start, np.zeros((40, 1)), 0.002)
    heights = [s.q[1] - 0.1 for s in states]

    def law(_t, y):
        return y[1], max(0.0, -25000 * y[0] - 250 * y[1]) * (y[0] < 0) / 3 - 9.81

    times = np.arange(41) * 0.002
    exact = solve_ivp(law, (0, 0.08), (0.0, -0.2), t_eval=times, rtol=1e-9, atol=1e-12).y[0]
    assert heights == pytest.approx(exact, abs=0.03 * np.abs(exact).max())
    settled = run(model, states[-1], np.zeros((20, 1)), 0.02)[-1]
    assert settled.q[1] - 0.1 == pytest.approx(-3 * 9.81 / 25000, rel=1e-3)


def test_in_the_air_it_converges_to_the_other_engines():
    rng, ours = np.random.default_rng(0), Model(LEO, engine='rigid')
    for _ in range(3):
        state, volts = airborne(rng), rng.uniform(-8.6, 8.6, 6)
        exact = ours.step(state, volts, 0.03)
        errors = []
        for step in (1e-3, 1e-4):
            there = Model(LEO, engine='mujoco', integration_step=step).step(state, volts, 0.03)
            errors.append(np.abs(there.dq - exact.dq).max())
        assert errors[0] < 0.2
        assert errors[1] < 0.2 * errors[0]


def test_on_the_ground_it_is_near_the_other_engines():
    rng, ours = np.random.default_rng(5), Model(LEO, engine='rigid')
    theirs = Model(LEO, engine='mujoco', integration_step=2e-4)
    off, moved = [], []
    for _ in range(12):
        state, volts = ours.start('random', rng), rng.uniform(-8.6, 8.6, 6)
        exact, there = (model.step(state, volts, 0.03) for model in (ours, theirs))
        off.append(there.dq - exact.dq)
        moved.append(exact.dq)
    assert np.sqrt(np.mean(np.square(off)) / np.mean(np.square(moved))) < 0.04


@pytest.mark.parametrize(
    'effect',
    [
        ('link_mass', 'torso', {'m': 0.3}),
        ('link_com', 'left_thigh', {'x': 0.02, 'z': 0.0}),
        ('external_force', 'torso', {'x': 3.0, 'z': 0.0}),
        ('viscous_friction', [a.joint for a in LEO.actuators], {'b': 0.05}),
        ('joint_spring', 'left_hip', {'k': 2.0, 'rest': 1.0}),
        ('torque_scale', 'right_knee', {'k': 0.7}),
        ('armature', 'left_ankle', {'J': 0.02}),
        ('voltage_limit', 'left_hip', {'v': 2.0}),
        ('command_delay', 'left_hip', {'delay': 0.01}),
    ],
    ids=lambda e: e[0],
)
def test_effects_do_what_they_do_elsewhere(effect):
    state, volts = airborne(np.random.default_rng(1)), np.full(6, 6.0)
    change = []
    for engine, step in (('rigid', None), ('mujoco', 2e-4)):
        how = {'engine': engine, 'integration_step': step}
        models = modelled(LEO, **how), modelled(LEO, effect, **how)
        plain, changed = (model.step(state, volts, 0.03) for model in models)
        change.append(np.concatenate([changed.q - plain.q, changed.dq - plain.dq]))
    assert np.abs(change[0]).max() > 1e-3
    assert change[1] == pytest.approx(change[0], abs=0.1 * np.abs(change[0]).max())


def test_a_late_sensor_is_as_late_as_elsewhere():
    placed = (place(LEO, 'measurement_delay', LEO.joint_names, delay=0.02),)
    state, volts = airborne(np.random.default_rng(1)), np.full(6, 6.0)
    late = []
    for engine, step in (('rigid', None), ('mujoco', 2e-4)):
        model = Model(LEO, placed, engine=engine, integration_step=step)
        after = model.step(state, volts, 0.03)
        late.append(after.q - model.sense(after)[0])
    assert np.abs(late[0]).max() > 0.02
    assert late[1] == pytest.approx(late[0], abs=0.1 * np.abs(late[0]).max())


def test_steps_are_pure_in_contact_too():
    rng = np.random.default_rng(2)
    volts, model = rng.uniform(-8.6, 8.6, (60, 6)), Model(LEO, engine='mujoco')
    states = run(model, model.start(), volts, 0.03)
    again = Model(LEO, engine='mujoco')
    for k in rng.permutation(60):
        for other in (model, again):
            following = other.step(states[k], volts[k], 0.03)
            assert following.q.tolist() == states[k + 1].q.tolist()
            assert following.dq.tolist() == states[k + 1].dq.tolist()


@pytest.mark.parametrize(
    ('name', 'values'),
    [
        ('backlash', {'gap': 0.02}),
        ('load_dependent_friction', {'mu': 0.1}),
        ('quadratic_load_friction', {'mu2': 0.1}),
    ],
)
def test_what_it_does_not_know_is_said(name, values):
    robot = load_robot('leo_ode')
    model = Model(robot, (place(robot, name, 'left_hip', **values),), engine='mujoco')
    with pytest.raises(UserError, match='engine mujoco knows no backlash and no friction that'):
        model.step(model.start(), np.zeros(6), 0.03)


def test_without_the_package_it_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, 'mujoco', None)
    monkeypatch.delattr('leo_sim.references.mujoco', raising=False)
    monkeypatch.delitem(sys.modules, 'leo_sim.references.mujoco', raising=False)
    model = Model(LEO, engine='mujoco')
    with pytest.raises(UserError, match=r"pip install 'mujoco>=3"):
        model.step(model.start(), np.zeros(6), 0.03)


def test_rates_belong_to_the_angles_of_their_time():
    """Half a substep between them would be 5 mrad at 10 rad/s."""
    robot = load_robot('torque_pendulum')
    ends = []
    for engine in ('mujoco', 'rk4'):
        model = Model(robot, engine=engine, integration_step=1e-3)
        track = stepped(model, np.full((50, 1), 0.5), 0.01, model.state_from([1.0], [10.0]))
        ends.append(np.concatenate(track, axis=1)[-1])
    assert ends[0] == pytest.approx(ends[1], abs=1e-4)
