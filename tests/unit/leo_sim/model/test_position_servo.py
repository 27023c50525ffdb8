# SPDX-License-Identifier: Apache-2.0
"""A position servo's own loop: against an integration of its equations written out here."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, solve_ivp
from tests.models import modelled, stepped

from leo_sim.description.constants import Constant
from leo_sim.description.robot import load_robot
from leo_sim.dynamics import whole_windows
from leo_sim.effects import place
from leo_sim.effects.base import Effect, Parameter
from leo_sim.model import Model
from leo_sim.model.batch import History, rollout

ROBOT = load_robot('xl330_pendulum')
MASS, LENGTH, INERTIA, G = 0.49, 0.1, 1.0e-4, 9.81
KT, OHM, ROTOR, SUPPLY, GAIN = 0.286, 2.0, 0.00257, 7.4, 1.1509
COUNT = 2 * np.pi / 4096
PERIOD = 0.01
RATE_GAIN = 'actuators.pivot.rate_gain'
GOALS = np.repeat([1.5, -0.4, 2.8, 0.3, -2.9], 30)  # rad; duty is clipped after the larger steps
EXACT = {'actuators.pivot.resolution': 0.0}


def simulated(effects=(), constants=EXACT, goals=GOALS, **model):
    made = Model(ROBOT, effects, constants, **model)
    return np.concatenate(stepped(made, goals[:, None], PERIOD), axis=1)


def integrated(
    volts=lambda v: v, gain=GAIN, rate_gain=0.0, supply=SUPPLY, zero=0.0, delay=0.0, goals=GOALS
):
    """The motion from the equations alone; `volts` is what becomes of the loop's voltage."""

    def derivative(t, y, goal):
        duty = np.clip(gain * (goal - y[0] - zero) - rate_gain * y[1], -1, 1)
        torque = KT * (volts(duty * supply) - KT * y[1]) / OHM
        torque -= MASS * G * LENGTH * np.sin(y[0])
        return y[1], torque / (MASS * LENGTH**2 + INERTIA + ROTOR)

    y, rows = np.zeros(2), [[zero, 0.0]]
    before = 0.0
    for goal in goals:
        for asked, span in ((before, delay), (goal, PERIOD - delay)):
            if span:
                given = {'args': (asked,), 'rtol': 1e-10, 'atol': 1e-12}
                y = solve_ivp(derivative, (0, span), y, **given).y[:, -1]
        rows.append([y[0] + zero, y[1]])
        before = goal
    return np.array(rows)


def apart(one, other):
    """The largest differences of angle rad and of rate rad/s."""
    return np.abs(one - other).max(axis=0)


@pytest.mark.parametrize(
    ('engine', 'step', 'angle', 'rate'),
    [
        ('rigid', None, 2e-3, 5e-2),
        ('rigid', 5e-4, 5e-5, 2e-3),
        ('pybullet', 5e-4, 5e-5, 2e-3),
        ('rk4', None, 5e-4, 1e-2),
        ('mujoco', 1e-4, 5e-3, 3e-2),
    ],
)
def test_every_engine_follows_the_equations_of_the_loop(engine, step, angle, rate):
    found = apart(simulated(engine=engine, integration_step=step), integrated())
    assert found[0] < angle
    assert found[1] < rate


@pytest.mark.parametrize(
    ('effects', 'constants', 'equations'),
    [
        ([('voltage_scale', {'k': 0.6})], {}, {'supply': 0.6 * SUPPLY}),
        (
            [('voltage_deadband', {'v': 0.5})],
            {},
            {'volts': lambda v: np.sign(v) * max(abs(v) - 0.5, 0.0)},
        ),
        ([('voltage_limit', {'v': 3.0})], {}, {'volts': lambda v: np.clip(v, -3.0, 3.0)}),
        ([('command_delay', {'delay': 0.004})], {}, {'delay': 0.004}),
        ([('servo_stiffness', {'k': 2.0})], {}, {'gain': 2.0 * GAIN}),
        ([('servo_damping', {'d': 0.03})], {RATE_GAIN: 0.01}, {'rate_gain': 0.03}),
        ([('encoder_offset', {'o': 0.2})], {}, {'zero': 0.2}),
        (
            [],
            {'actuators.pivot.position_gain': 3.0, RATE_GAIN: 0.02},
            {'gain': 3.0, 'rate_gain': 0.02},
        ),
        (
            [],
            {'actuators.pivot.supply': 5.0, 'sensors.pivot.offset': 0.1},
            {'supply': 5.0, 'zero': 0.1},
        ),
    ],
    ids=['scale', 'zone', 'limit', 'delay', 'k', 'd', 'offset', 'gains', 'constants'],
)
def test_effects_and_constants_act_where_the_loop_has_them(effects, constants, equations):
    placed = [place(ROBOT, name, 'pivot', **values) for name, values in effects]
    found = simulated(placed, EXACT | constants, engine='rigid', integration_step=5e-4)
    assert apart(found, integrated(**equations))[0] < 5e-4
    assert apart(found, integrated())[0] > 0.01


def test_windows_at_once_give_what_steps_give_for_every_gain():
    gains = np.array([0.5, 1.1509, 2.5])
    path = 'actuators.pivot.position_gain'
    model, zero = Model(ROBOT, constants=EXACT | {path: gains[:, None, None]}), np.zeros((1, 1))
    together = rollout(model, zero, zero, GOALS[None, :, None], PERIOD)
    for row, gain in enumerate(gains):
        alone = simulated(constants=EXACT | {path: gain}, engine='rigid')
        np.testing.assert_allclose(together[0][row, 0, :, 0], alone[:, 0], atol=1e-9)


def test_one_servo_of_an_arm_may_have_another_gain():
    one, two = (modelled('so101', ('servo_stiffness', 'elbow_flex', {'k': k})) for k in (1.0, 2.0))
    ratio = two.laws.servos.loop.gain / one.laws.servos.loop.gain
    np.testing.assert_allclose(ratio, [1, 1, 2, 1, 1, 1])


def test_a_free_motor_has_no_loop():
    goals, zeros = (np.full((1, 50, 1), goal) for goal in (2.0, 0.0))
    off = np.zeros((1, 50, 1), dtype=bool)
    begin = Model(ROBOT), np.ones((1, 1)), np.zeros((1, 1))
    swings = [rollout(*begin, u, PERIOD, enabled=off)[0] for u in (goals, zeros)]
    np.testing.assert_array_equal(*swings)
    assert np.ptp(swings[0]) > 0.5


def test_less_than_a_count_of_error_is_none():
    """Half a turn of gravity away, the smallest voltage would move it."""
    model = Model(ROBOT, constants={'gravity': 0.0})
    start = model.start('nominal')
    near, far = (model.step(start, [goal], PERIOD).q[0] for goal in (0.4 * COUNT, 0.6 * COUNT))
    assert near == 0.0
    assert far > 0.0


@pytest.mark.parametrize(('own', 'effect'), [(2.0, []), (5.0, [2.0]), (1.0, [2.0])])
def test_the_goal_moves_no_faster_than_its_rate(own, effect):
    path = 'actuators.pivot.goal_rate'
    limited = ROBOT.with_constants({path: Constant(path, own, 'rad/s')})
    placed = [place(limited, 'goal_rate', 'pivot', rate=rate) for rate in effect]
    assert place(limited, 'goal_rate', 'pivot').parameters == {'rate': own}
    model = Model(limited, placed, EXACT, engine='rigid', integration_step=5e-4)
    angles = stepped(model, np.array([0.0] + 99 * [1.0])[:, None], PERIOD)[0][1:, 0]
    ramped = integrated(goals=np.clip(2.0 * PERIOD * (np.arange(100) - 0.5), 0.0, 1.0))[1:, 0]
    assert np.abs(angles - ramped).max() < 2e-3


@pytest.mark.parametrize('rate', [None, 1.5])
def test_the_goal_gathers_speed_and_brakes_before_it_is_there(rate):
    path = 'actuators.pivot.goal_rate'
    robot = ROBOT.with_constants({path: Constant(path, rate, 'rad/s')}) if rate else ROBOT
    placed = [place(robot, 'goal_acceleration', 'pivot', a=20.0)]
    model = Model(robot, placed, EXACT, engine='rigid', integration_step=5e-4)
    angles = stepped(model, np.array([0.0] + 99 * [1.0])[:, None], PERIOD)[0][1:, 0]
    fast = min(rate or np.inf, np.sqrt(20.0))
    t = np.linspace(0.0, fast / 20.0 + 1.0 / fast, 2001)
    gone = cumulative_trapezoid(np.minimum(20.0 * np.minimum(t, t[-1] - t), fast), t, initial=0.0)
    gentle = np.interp(PERIOD * (np.arange(100) - 0.5), t, gone)
    assert np.abs(angles - integrated(goals=gentle)[1:, 0]).max() < 2e-3


@pytest.mark.parametrize(
    ('name', 'values'),
    [
        ('voltage_scale', {'k': 0.6}),
        ('voltage_deadband', {'v': 0.5}),
        ('voltage_limit', {'v': 3.0}),
        ('encoder_scale', {'k': 1.3}),
        ('encoder_offset', {'o': 0.2}),
        ('torque_scale', {'k': 0.7}),
        ('load_dependent_friction', {'mu': 0.2}),
        ('servo_stiffness', {'k': 0.6}),
        ('servo_damping', {'d': 0.02}),
        ('goal_rate', {'rate': 4.0}),
        ('goal_acceleration', {'a': 40.0}),
        ('backlash', {'gap': 0.05}),
    ],
)
def test_windows_give_what_steps_give_with_every_kind_of_effect(name, values):
    placed = place(ROBOT, name, 'pivot', **values)
    constants = {RATE_GAIN: 0.01}
    on = np.ones((1, len(GOALS), 1), dtype=bool)
    on[:, 40:50] = False
    model = Model(ROBOT, [placed], constants, engine='rigid')
    alone = stepped(model, GOALS[:, None], PERIOD, enabled=on[0])[0]
    at_once = whole_windows.possible(model.laws, np.zeros((1, 1)), GOALS[None, :, None])
    assert at_once == (name != 'backlash')
    together = rollout(model, alone[:1], np.zeros((1, 1)), GOALS[None, :, None], PERIOD, on)
    np.testing.assert_allclose(together[0][0], alone, atol=1e-8)


def test_a_law_of_the_users_behind_the_loop_that_no_compiler_takes_goes_by_substeps():
    class Odd(Effect):
        name, family, hook = 'odd', 'command', 'command'
        parameters = (Parameter('k', '', neutral=1.0, role='amplitude'),)

        def command(self, p, u, memory, dt):
            return p['k'] * np.array([float(str(v)) for v in u.ravel()]).reshape(u.shape), memory

    effects = (place(ROBOT, effect, 'pivot', k=0.6) for effect in (Odd(), 'voltage_scale'))
    odd, even = (Model(ROBOT, [effect], engine='rigid') for effect in effects)
    goals, zero = GOALS[None, :40, None], np.zeros((1, 1))
    assert not whole_windows.possible(odd.laws, zero, goals)
    angles = (rollout(m, zero, zero, goals, PERIOD)[0] for m in (odd, even))
    np.testing.assert_allclose(*angles, atol=1e-9)


@pytest.mark.parametrize(
    ('name', 'values', 'most'),
    [('command_delay', {'delay': 0.02}, 1e-4), ('backlash', {'gap': 0.03}, 1e-3)],
)
def test_windows_amid_a_run_know_what_went_before(name, values, most):
    """The states between are those of another integrator; half a second later none is off."""
    effects = [place(ROBOT, name, 'pivot', **values)]
    run = simulated(effects, {}, engine='rk4')
    starts, before, ahead = np.arange(30, 100, 10), 30, 50

    def cut(of: np.ndarray, first: int, count: int) -> np.ndarray:
        return np.stack([of[i + first : i + first + count] for i in starts])

    q, dq, u = run[:, :1], run[:, 1:], GOALS[:, None]
    past = (cut(of, -before, before) for of in (q, dq, u))
    history = History(*past, None, np.full((len(starts), before), PERIOD))
    given = q[starts], dq[starts], cut(u, 0, ahead)
    angles = rollout(Model(ROBOT, effects), *given, PERIOD, history=history)[0]
    assert np.abs(angles - cut(q, 0, ahead + 1))[:, -1].max() < most
