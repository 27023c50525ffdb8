# SPDX-License-Identifier: Apache-2.0
"""Laws of friction under load, of a push and of a payload, against their formulas."""

import numpy as np
import pytest

from leo_msgs_py.errors import UserError
from leo_sim.description.joint import Body
from leo_sim.description.robot import load_robot
from leo_sim.effects import EFFECTS, place
from leo_sim.effects.motor import Motor, sagging, voltage_motor
from leo_sim.model import Model
from leo_sim.model.batch import rollout

TORQUE = load_robot('torque_pendulum')
PUSH = 0.3


def friction(name, w, motor, load, *memory, **p):
    one = (np.array([float(x)]) for x in (0.0, w))
    drive, weight = Motor(np.array([motor]), 0.0), np.array([load])
    (torque,) = EFFECTS[name].torque(p, *one, drive, weight, *memory)
    return torque


@pytest.mark.parametrize('w', [-2.0, 0.3, 4.0])
@pytest.mark.parametrize(('motor', 'load'), [(1.5, -0.5), (-0.4, 1.0)])
def test_the_share_of_the_load_falls_with_speed(w, motor, load):
    mine = friction('stribeck_load_friction', w, motor, load, mu=0.1, mu_static=0.4, v_s=1.0)
    share = 0.1 + 0.3 * np.exp(-(w**2))
    assert mine == pytest.approx(-np.sign(w) * share * abs(motor - load))


@pytest.mark.parametrize('w', [-2.0, 0.3])
def test_a_square_of_the_load(w):
    mine = friction('quadratic_load_friction', w, 1.5, -0.5, mu=0.1, mu2=0.05)
    assert mine == pytest.approx(-np.sign(w) * (0.1 * 2.0 + 0.05 * 4.0))


@pytest.mark.parametrize(
    ('w', 'motor', 'load', 'share'),
    [
        (1.0, 1.5, -0.5, 0.1),
        (-1.0, 1.5, -0.5, 0.3),
        (-1.0, -0.2, -0.5, 0.1),
        (1.0, 0.0, 0.5, 0.3),
        (0.0, 1.5, -0.5, 0.1),
        (0.0, 0.2, -0.5, 0.3),
        (1e-17, 0.2, -0.5, 0.3),
        (1e-17, -1e-17, -0.5, 0.3),
    ],
    ids=['lifts', 'lowers', 'drives down', 'free', 'lifts off', 'yields', 'held', 'held, free'],
)
def test_the_motor_drives_or_is_driven(w, motor, load, share):
    mine = friction('directional_load_friction', w, motor, load, mu=0.1, mu_back=0.3)
    assert abs(mine) == pytest.approx(share * abs(motor - load))


def test_a_push_undoes_a_dead_band():
    u = np.array([-2.0, -0.1, 0.0, 0.1, 2.0])
    pushed, _ = EFFECTS['voltage_push'].command({'v': PUSH}, u, None, 0.01)
    np.testing.assert_allclose(pushed, [-2.3, -0.4, 0.0, 0.4, 2.3])
    back, _ = EFFECTS['voltage_deadband'].command({'v': PUSH}, pushed, None, 0.01)
    np.testing.assert_allclose(back, u, atol=1e-15)
    inputs = np.random.default_rng(0).uniform(-1, 1, (1, 40, 1))
    dead = place(TORQUE, 'voltage_deadband', 'all', v=PUSH)
    both = Model(TORQUE, [dead, place(TORQUE, 'voltage_push', 'all', v=PUSH)])
    kept = np.where(np.abs(inputs) > PUSH, inputs, 0.0)
    runs = (Model(TORQUE), kept), (both, inputs)
    plain, after = (rollout(m, [[0.1]], [[0.0]], u, 0.01)[0] for m, u in runs)
    np.testing.assert_allclose(after, plain, atol=1e-12)


LINK = Body(0.7, (0.02, -0.05, 0.11), (0.004, 0.005, 0.003, 0.0003, -0.0002, 0.0001))
LOAD = {'m': 0.4, 'x': 0.1, 'y': -0.2, 'z': 0.3}


def about_origin(mass, com, inertia):
    """Mass, first moments and inertia about the origin of the link: these add up."""
    xx, yy, zz, xy, xz, yz = inertia
    r = np.array(com)
    turning = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return np.r_[mass, mass * r, (turning + mass * (r @ r * np.eye(3) - np.outer(r, r))).ravel()]


def test_a_payload_is_the_link_and_a_point_mass_as_one_body():
    one = EFFECTS['payload'].body(LOAD, LINK)
    point = about_origin(LOAD['m'], [LOAD[axis] for axis in 'xyz'], [0.0] * 6)
    np.testing.assert_allclose(about_origin(*one[:3]), about_origin(*LINK[:3]) + point, atol=1e-15)


@pytest.mark.parametrize(('t', 'level', 'lost'), [(0.0, 0.5, 0.0), (3.0 * np.log(2), 0.37, 0.2)])
def test_friction_and_motors_come_to_rest_with_time(t, level, lost):
    dry = friction('warming_friction', -2.0, 0.8, 0.0, t, c=0.24, c_start=0.5, T=3.0)
    mine = friction('torque_fade', 1.0, 0.8, 0.0, t, s=0.5, T=3.0)
    assert (dry, mine) == pytest.approx((level, -lost))


def test_what_all_bridges_draw_is_missing_of_the_supply():
    volts, speed, on = np.array([6.0, -9.0, 5.0]), np.array([1.0, 2.0, -3.0]), np.array([1, 1, 0])
    constant, resistance, supply, source = np.array([1.2, 0.8, 0.5]), np.array([3, 2, 2]), 12, 0.3
    left = sagging(volts, speed, (constant, resistance, supply, on), source)
    torque = voltage_motor(left * volts, speed, constant, resistance, on).torque
    drawn = (volts / supply * torque / constant).sum()
    assert left == pytest.approx(1 - source * drawn / supply)


def test_gravity_pulls_links_by_the_mass_that_they_have_in_the_end():
    robot, inputs = load_robot('double_pendulum'), np.full((1, 30, 2), 0.5)
    more = place(robot, 'link_mass', 'lower', m=0.3)
    pulled = place(robot, 'gravity', 'all', z=-1.2)
    heavier = Model(robot, [more], {'gravity': 11.01})
    models = heavier, *(Model(robot, pair) for pair in ([more, pulled], [pulled, more]))
    start = np.array([[0.4, -0.3]]), np.zeros((1, 2))
    angles, *others = (rollout(model, *start, inputs, 0.01)[0] for model in models)
    assert all(np.allclose(other, angles, atol=1e-9) for other in others)


def test_gravity_acts_on_all_or_nothing_and_is_told_as_a_direction():
    robot, gravity = load_robot('double_pendulum'), EFFECTS['gravity']
    with pytest.raises(UserError, match='place it at all'):
        place(robot, 'gravity', 'lower', x=1.0)
    assert not any(gravity.applies(load_robot(name)) for name in ('pendulum', 'leo'))
    turned = {'x': -9.81 * np.sin(0.6109), 'z': 9.81 * (1 - np.cos(0.6109))}
    words = gravity.in_words(turned, 'all', {'gravity': 9.81})
    assert words == 'which is gravity of 9.81 m/s2, turned by 35 degrees towards -x'
    told = EFFECTS['link_mass'].in_words({'m': 1.7}, 'lower', {'links.lower.mass': 0.676})
    assert told == 'added to 0.676 kg'


def test_an_eccentric_encoder_swings_once_a_turn_and_can_be_read_back():
    law, p = EFFECTS['encoder_eccentricity'], {'a': 0.3, 'b': -0.2}
    q, step, still = np.linspace(-7.0, 7.0, 57), 1e-6, np.zeros(57)
    read, rate, _ = law.sensor(p, q, still + 2.0, None, 0.0)
    before, after = (law.sensor(p, q + d, still, None, 0.0)[0] for d in (-step, step))
    np.testing.assert_allclose(rate, (after - before) / step, atol=1e-8)
    np.testing.assert_allclose(law.sensor(p, q + 2 * np.pi, still, None, 0.0)[0], read + 2 * np.pi)
    true, speed, _ = law.unsensed(p, read, rate)
    np.testing.assert_allclose(np.stack([true, speed]), [q, still + 2.0], atol=1e-12)
    assert law.sensor(p, np.zeros(1), np.zeros(1), None, 0.0)[0] == 0.0
    assert law.in_words({'a': 0.03, 'b': 0.04}, 'pivot', {}) == 'an amplitude of 0.05 rad'
