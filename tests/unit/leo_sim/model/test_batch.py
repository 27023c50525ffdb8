# SPDX-License-Identifier: Apache-2.0
"""Batched rollouts: scans, uneven times, histories, constants."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from tests.models import modelled, stepped

from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.batch import rollout

ROBOT, ARM = load_robot('pendulum'), load_robot('double_pendulum')
RNG = np.random.default_rng(0)
Q0, DQ0 = RNG.uniform(-3, 3, (4, 1)), RNG.uniform(-5, 5, (4, 1))
INPUTS = RNG.uniform(-3, 3, (4, 6, 1))
DT = RNG.uniform(0.002, 0.03, (4, 6))


def scanned(*values):
    return np.array(values)[:, None, None]


@pytest.mark.parametrize(
    ('effect', 'where', 'name', 'values'),
    [
        ('viscous_friction', 'pivot', 'b', (0.0, 1e-5, 1e-4)),
        ('command_delay', 'pivot', 'delay', (0.0, 0.004, 0.03)),
        ('actuator_lag', 'pivot', 'tau', (0.0, 0.01, 0.1)),
        ('backlash', 'pivot', 'gap', (0.0, 0.01, 0.1)),
        ('stribeck_friction', 'pivot', 'c_static', (0.0, 1e-3, 3e-3)),
        ('link_mass', 'bob', 'm', (0.0, 0.01, 0.04)),
        ('external_force', 'bob', 'x', (0.0, -0.1, 0.2)),
        ('encoder_offset', 'pivot', 'o', (0.0, -0.1, 0.2)),
        ('encoder_scale', 'pivot', 'k', (1.0, 0.9, 1.2)),
        ('encoder_eccentricity', 'pivot', 'a', (0.0, -0.1, 0.2)),
        ('velocity_lag', 'pivot', 'tau', (0.0, 0.004, 0.05)),
        ('measurement_delay', 'pivot', 'delay', (0.0, 0.004, 0.03)),
    ],
)
def test_a_scan_equals_its_single_runs(effect, where, name, values):
    scan = Model(ROBOT, [place(ROBOT, effect, where, **{name: scanned(*values)})])
    q, dq = rollout(scan, Q0, DQ0, INPUTS, DT)
    assert q.shape == dq.shape == (3, 4, 7, 1)
    for i, value in enumerate(values):
        single = Model(ROBOT, [place(ROBOT, effect, where, **{name: value})])
        one_q, one_dq = rollout(single, Q0, DQ0, INPUTS, DT)
        assert q[i] == pytest.approx(one_q, abs=1e-10)
        assert dq[i] == pytest.approx(one_dq, abs=1e-9)


@pytest.mark.parametrize(
    'path',
    [
        *('actuators.pivot.resistance', 'actuators.pivot.rotor_inertia', 'links.bob.mass'),
        *('joints.pivot.damping', 'gravity'),
    ],
)
def test_constants_can_be_scanned(path):
    values = ROBOT.constants[path].value * np.array([1.0, 1.3])
    q, _ = rollout(Model(ROBOT, constants={path: scanned(*values)}), Q0, DQ0, INPUTS, DT)
    for i, value in enumerate(values):
        one, _ = rollout(Model(ROBOT, constants={path: value}), Q0, DQ0, INPUTS, DT)
        assert q[i] == pytest.approx(one, abs=1e-10)
    assert abs(q[1] - q[0]).max() > 1e-9


def test_measured_start_is_returned_unchanged():
    wrong = ('encoder_offset', {'o': 0.2}), ('encoder_scale', {'k': 1.1})
    lag = ('velocity_lag', {'tau': 0.02})
    model = modelled(ROBOT, *wrong, lag, constants={'gravity': 9.7})
    past = (Q0[:, None], DQ0[:, None], INPUTS[:, :1], None, np.full((4, 1), 0.01))
    for history in (None, past):
        q, dq = rollout(model, Q0, DQ0, INPUTS, DT, history=history)
        assert q[:, 0] == pytest.approx(Q0, abs=1e-12)
        assert dq[:, 0] == pytest.approx(DQ0, abs=1e-12)


def test_a_late_state_is_the_one_before():
    late = Model(ROBOT, [place(ROBOT, 'measurement_delay', 'pivot', delay=0.02)])
    q, dq = rollout(Model(ROBOT), [[2.0]], [[3.0]], INPUTS[:1], 0.01)
    read_q, read_dq = rollout(late, [[2.0]], [[3.0]], INPUTS[:1], 0.01)
    assert read_q[:, 2:] == pytest.approx(q[:, :-2], abs=1e-12)
    assert read_dq[:, 2:] == pytest.approx(dq[:, :-2], abs=1e-12)
    assert np.ptp(read_q[:, :3]) == 0


def test_a_lagging_rate_is_a_filtered_one():
    tau, h = 0.03, 1e-3
    lag = Model(ROBOT, [place(ROBOT, 'velocity_lag', 'pivot', tau=tau)])
    inputs = np.repeat(INPUTS[:1], 20, axis=1)
    true, read = (rollout(m, [[2.0]], [[3.0]], inputs, h)[1][0, :, 0] for m in (Model(ROBOT), lag))
    expected = lfilter([1 - np.exp(-h / tau)], [1, -np.exp(-h / tau)], true - true[0]) + true[0]
    assert read == pytest.approx(expected, abs=2e-2 * np.ptp(true))
    assert np.ptp(read - true) > 0.1


@pytest.mark.parametrize(
    ('effect', 'values', 'exact'),
    [
        ('command_delay', {'delay': 0.013}, 1e-9),
        ('actuator_lag', {'tau': 0.02}, 1e-9),
        ('backlash', {'gap': 0.1}, 0.2),
        ('velocity_lag', {'tau': 0.02}, 0.02),
        ('measurement_delay', {'delay': 0.013}, 0.1),
    ],
)
@pytest.mark.parametrize('robot', [ROBOT, ARM], ids=['pendulum', 'double_pendulum'])
def test_history_warms_up_what_effects_remember(effect, values, exact, robot):
    model = Model(robot, [place(robot, effect, 'all', **values)])
    joints, cut = len(robot.joint_names), 40
    inputs = 0.5 * RNG.uniform(-1, 1, (1, 60, joints)) * robot.limits
    enabled = RNG.uniform(size=inputs.shape) > 0.1
    q, dq = rollout(model, [[2.0] * joints], [[0.0] * joints], inputs, 0.01, enabled)
    past = (q[:, :cut], dq[:, :cut], inputs[:, :cut], enabled[:, :cut], np.full((1, cut), 0.01))
    rest = inputs[:, cut:], 0.01, enabled[:, cut:]
    _, warm = rollout(model, q[:, cut], dq[:, cut], *rest, history=past)
    _, cold = rollout(model, q[:, cut], dq[:, cut], *rest)
    lost = abs(cold - dq[:, cut:]).max()
    assert lost > 1e-3
    assert abs(warm - dq[:, cut:]).max() < exact * lost


def test_delay_is_continuous():
    """A tenth of a substep more delay changes the motion by a tenth of what a whole one does."""
    step = ROBOT.integration_step
    delays = 0.01 + step * np.array([0.0, 0.1, 1.0])
    model = Model(ROBOT, [place(ROBOT, 'command_delay', 'pivot', delay=scanned(*delays))])
    _, dq = rollout(model, Q0, DQ0, INPUTS, 0.02)
    small, large = (abs(dq[i, :, -1] - dq[0, :, -1]).mean() for i in (1, 2))
    assert small == pytest.approx(0.1 * large, rel=0.1)


def test_delay_of_whole_periods_shifts_the_inputs():
    late = Model(ROBOT, [place(ROBOT, 'command_delay', 'pivot', delay=0.02)])
    shifted = np.concatenate([np.zeros((4, 1, 1)), INPUTS[:, :-1]], axis=1)
    q, _ = rollout(late, Q0, DQ0, INPUTS, 0.02)
    expected, _ = rollout(Model(ROBOT), Q0, DQ0, shifted, 0.02)
    assert q == pytest.approx(expected, abs=1e-12)


def test_push_is_a_torque_on_the_links():
    q, _ = rollout(Model(ROBOT), Q0, DQ0, INPUTS, 0.02, push=np.full((4, 6, 1), 2e-3))
    biased = Model(ROBOT, [place(ROBOT, 'bias_torque', 'pivot', t=2e-3)])
    assert q == pytest.approx(rollout(biased, Q0, DQ0, INPUTS, 0.02)[0], abs=1e-12)


@pytest.mark.parametrize('engine', ['pybullet', 'rigid', 'rk4', 'mujoco'])
def test_a_step_takes_a_push_as_well(engine):
    if engine == 'mujoco':
        pytest.importorskip('mujoco')
    plain = Model(ROBOT, engine=engine)
    biased = plain.changed(effects=[place(ROBOT, 'bias_torque', 'pivot', t=2e-3)])
    state = plain.state_from(Q0[0], DQ0[0])
    pushed = plain.step(state, [1.0], 0.02, push=np.array([2e-3]))
    assert pushed.dq == pytest.approx(biased.step(state, [1.0], 0.02).dq, abs=1e-9)
    assert abs(pushed.dq - plain.step(state, [1.0], 0.02).dq) > 0.1


@pytest.mark.parametrize('robot', [ROBOT, ARM], ids=['pendulum', 'double_pendulum'])
@pytest.mark.parametrize('slow', [(), ('actuator_lag', {'tau': 0.02}), ('backlash', {'gap': 0.1})])
def test_a_payload_that_is_hung_on_is_the_same_in_steps_and_in_windows(robot, slow):
    values = {'m': 0.02, 'x': 0.03, 'z': 0.04}
    late = modelled(robot, ('late_payload', values | {'t0': 3.05}), *([slow] if slow else []))
    joints = len(robot.joint_names)
    inputs = 0.3 * RNG.uniform(-1, 1, (2, 30, joints)) * robot.limits
    begun, q0 = np.array([0.5, 3.0]), np.full((2, joints), 2.0)
    q, _ = rollout(late, q0, 0 * q0, inputs, 0.01, start=begun)
    for w, elapsed in enumerate(begun):
        state = replace(late.state_from(q0[w], 0 * q0[w]), memory={'time': np.array([elapsed])})
        assert q[w] == pytest.approx(stepped(late, inputs[w], state=state)[0], abs=1e-9)
    before, after = (
        rollout(modelled(robot, *some, *([slow] if slow else [])), q0, 0 * q0, inputs, 0.01)[0]
        for some in ((), [('payload', values)])
    )
    assert q[0] == pytest.approx(before[0], abs=1e-9)
    assert abs(q[1] - before[1]).max() > 1e-6 < abs(q[1] - after[1]).max()
