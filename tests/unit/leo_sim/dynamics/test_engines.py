# SPDX-License-Identifier: Apache-2.0
"""The engines against each other, against hand calculation and against conservation laws."""

from functools import cache
from itertools import product

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tests import robots
from tests.models import modelled, stepped

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.description.urdf import Body, parse
from leo_sim.dynamics.pybullet import Bullet
from leo_sim.dynamics.spatial import Spatial
from leo_sim.effects import EFFECTS
from leo_sim.model import Model, State
from leo_sim.model.batch import rollout
from leo_sim.truth.drawing import of_size, Windows

ROBOTS = {
    name: load_robot(name)
    for name in ('pendulum', 'torque_pendulum', 'servo_pendulum', 'double_pendulum')
}
PLACES = [
    (robot, effect)
    for robot, effect in product(ROBOTS, EFFECTS)
    if EFFECTS[effect].applies(ROBOTS[robot])
]
BRACKET = """<joint name="bracket" type="fixed">
    <parent link="upper"/><child link="plate"/><origin xyz="0.05 0.02 0.2" rpy="0 0.7 0"/>
  </joint>
  <link name="plate"><inertial>
    <origin xyz="0 0.03 0.01"/><mass value="0.2"/>
    <inertia ixx="0.001" iyy="0.001" izz="0.0015" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>
</robot>"""
ARM = robots.ARM.urdf.replace('"upper"/><child link="rail"', '"plate"/><child link="rail"')
ARM = ARM.replace('</robot>', BRACKET)


def arm(forces=False):
    links, joints = parse(ARM, 'arm.urdf')
    bodies = {link.name: link.body for link in links}
    if forces:
        bodies['upper'] = bodies['upper']._replace(force=(0.3, 0.2, -0.4))
        bodies['hand'] = bodies['hand']._replace(force=(-0.5, 0.1, 0.6))
    return Spatial(joints, bodies, 9.81), Bullet(ARM, joints, bodies, 9.81)


@pytest.mark.parametrize('gravity', [9.81, np.array([[9.81], [1.6]])])
def test_a_scan_has_the_numbers_of_each_value(gravity):
    links, joints = parse(ARM, 'arm.urdf')
    bodies = {link.name: link.body for link in links}
    bodies['upper'] = bodies['upper']._replace(force=(0.3, 0.2, -0.4))
    masses, q, dq = (0.3, 0.5), *np.random.default_rng(2).normal(size=(2, 2, 5, 3))
    scan = bodies | {'hand': bodies['hand']._replace(mass=np.array(masses)[:, None])}
    scanned = Spatial(joints, scan, gravity).mass_and_bias(q, dq)
    for n, (mass, down) in enumerate(zip(masses, np.broadcast_to(gravity, (2, 1)), strict=True)):
        one = Spatial(joints, bodies | {'hand': bodies['hand']._replace(mass=mass)}, down[0])
        for ours, theirs in zip(scanned, one.mass_and_bias(q[n], dq[n]), strict=True):
            np.testing.assert_allclose(ours[n], theirs, atol=1e-13)


@pytest.mark.parametrize('forces', [False, True])
def test_a_tree_in_space_agrees_with_pybullet_which_moves_as_it_is_told(forces):
    rigid, bullet = arm(forces)
    rng = np.random.default_rng(1)
    for _ in range(20):
        q, dq = rng.uniform(-2, 2, 3), rng.uniform(-4, 4, 3)
        ours, theirs = rigid.mass_and_bias(q, dq), bullet.mass_and_bias(q, dq)
        assert ours[0] == pytest.approx(theirs[0], abs=1e-12)
        assert ours[1] == pytest.approx(theirs[1], abs=1e-12)
        assert rigid.load(q) == pytest.approx(bullet.load(q), abs=1e-12)
        faster = dq + rng.normal(0, 0.1, 3)
        bullet.begin(q, dq, 1e-3)
        bullet.mass_and_bias(q, dq)
        moved, rates = bullet.move(q, dq, faster, 1e-3)
        assert rates == pytest.approx(faster, abs=1e-12)
        assert moved == pytest.approx(q + 1e-3 * faster, abs=1e-12)


@cache
def drawn(robot, effect):
    """An effect of 20 noise floors somewhere on the robot, or of less where that is too much."""
    robot, rng = ROBOTS[robot], np.random.default_rng(4)
    where = 'all' if EFFECTS[effect].undivided else EFFECTS[effect].places(robot)[0]
    windows = Windows(robot, rng)
    sizes = (of_size(windows, effect, where, size, rng) for size in (20.0, 5.0, 1.0, 0.2))
    placed = next((p for p in sizes if p is not None), None)
    assert placed is not None, f'no amplitude of {effect} shows on {robot.name}'
    return placed


@pytest.mark.parametrize(('robot', 'effect'), PLACES)
def test_pybullet_and_batched_rollouts_agree_with_every_effect(robot, effect):
    placed, robot = drawn(robot, effect), ROBOTS[robot]
    model = Model(robot, [placed])
    rng = np.random.default_rng(5)
    inputs = rng.uniform(-0.8, 0.8, (15, len(robot.limits))) * robot.limits
    enabled = rng.uniform(size=inputs.shape) > 0.2
    start = ([2.9, 0.5][: len(robot.limits)], [1.0, -2.0][: len(robot.limits)])
    angles, rates = stepped(model, inputs, 0.011, model.state_from(*start), enabled)
    q, dq = rollout(model, *np.array(start)[:, None], inputs[None], 0.011, enabled[None])
    assert q[0] == pytest.approx(angles, abs=1e-8)
    assert dq[0] == pytest.approx(rates, abs=1e-7)


@pytest.mark.parametrize(('robot', 'effect'), PLACES)
def test_runge_kutta_with_events_agrees_with_every_effect(robot, effect):
    """Rates within 1 % of the move in a control step, unless play makes it chaotic."""
    placed, robot = drawn(robot, effect), ROBOTS[robot]
    fine = robot.integration_step / 4
    ours = Model(robot, [placed], engine='rigid', integration_step=fine)
    other = Model(robot, [placed], engine='rk4', integration_step=fine)
    rng = np.random.default_rng(6)
    inputs = rng.uniform(-0.8, 0.8, (15, len(robot.limits))) * robot.limits
    state, differences = ours.state_from(2.9 + 0 * robot.limits, 1.0 + 0 * robot.limits), []
    for u in inputs:
        after, same = (m.step(state, u, robot.control_period) for m in (ours, other))
        moved = abs(after.dq - state.dq).max() + abs(after.q - state.q).max()
        differences.append(abs(after.dq - same.dq).max() / moved)
        state = after
    assert np.median(differences) < 0.01


def pendulum_by_hand(start, u):
    """The motion of docs/reference/leo.md 9 after 0.05 s."""
    J, m, length, b, K, R = 0.000191, 0.055, 0.042, 3e-6, 0.0536, 9.5

    def slope(_, y):
        torque = m * 9.81 * length * np.sin(y[0]) - (b + K * K / R) * y[1] + K / R * u
        return [y[1], torque / J]

    return solve_ivp(slope, (0, 0.05), start, rtol=1e-12, atol=1e-13).y[:, -1]


@pytest.mark.parametrize(
    ('start', 'u'), [((1.0, 0.0), 3.0), ((2.5, 10.0), -3.0), ((3.1, -12.0), 1.0)]
)
def test_pendulum_is_the_one_of_the_thesis(start, u):
    model = Model(ROBOTS['pendulum'], integration_step=1e-4)
    after = model.step(State(np.array(start[:1]), np.array(start[1:])), [u], 0.05)
    assert [after.q[0], after.dq[0]] == pytest.approx(pendulum_by_hand(start, u), abs=5e-6)


def test_heavier_bob_with_the_thesis_inertia_about_the_pivot():
    inertia = ('link_inertia', 'bob', {'I': -0.035 * 0.042**2})
    model = modelled(ROBOTS['pendulum'], ('link_mass', 'bob', {'m': 0.035}), inertia)
    mass, bias = model.rigid.mass_and_bias(np.array([1.0]), np.array([0.0]))
    assert mass[0, 0] + model.laws.rotor_inertia[0] == pytest.approx(0.000191, abs=1e-15)
    assert bias[0] == pytest.approx(-0.09 * 9.81 * 0.042 * np.sin(1.0))


def test_torque_pendulum_is_the_cad_model_of_the_rig():
    model = Model(ROBOTS['torque_pendulum'])
    mass, bias = model.rigid.mass_and_bias(np.array([np.pi / 2]), np.array([0.0]))
    assert mass[0, 0] + model.laws.rotor_inertia[0] == pytest.approx(0.1495, abs=5e-5)
    assert bias[0] == pytest.approx(2.997, abs=5e-4)


def test_energy_is_kept_without_motor_and_friction():
    robot = ROBOTS['torque_pendulum']
    q, dq = rollout(Model(robot), [[2.0]], [[3.0]], np.zeros((1, 1000, 1)), 0.01)
    energy = 0.5 * 0.149519217 * dq**2 - 2.996955 * np.cos(q)
    assert np.ptp(energy) < 2e-3 * np.ptp(0.5 * 0.1495 * dq**2)
    assert abs(energy[0, -100:].mean() - energy[0, :100].mean()) < 1e-5


def test_free_motor_does_not_brake_and_a_shorted_one_does():
    model = Model(ROBOTS['pendulum'], constants={'joints.pivot.damping': 0.0})
    start = State(np.array([np.pi]), np.array([8.0]))
    free = model.step(start, [0.0], 0.01, enabled=[False])
    shorted = model.step(start, [0.0], 0.01, enabled=[True])
    driven = model.step(start, [3.0], 0.01, enabled=[False])
    assert shorted.dq[0] < free.dq[0] < 8.0
    assert driven.dq[0] == free.dq[0]


def test_stop_holds_the_joint_in_both_engines(tmp_path):
    robot_file = ROBOTS['torque_pendulum'].folder / 'robot.yaml'
    (tmp_path / 'robot.yaml').write_text(robot_file.read_text())
    text = ROBOTS['torque_pendulum'].urdf.replace('type="continuous"', 'type="revolute"')
    text = text.replace('<axis', '<limit lower="-0.5" upper="0.6"/><axis')
    (tmp_path / 'robot.urdf').write_text(text)
    robot = load_robot(tmp_path)
    inputs = np.full((1, 100, 1), 4.0)
    q, dq = rollout(Model(robot), [[0.0]], [[0.0]], inputs, 0.01)
    assert q.max() <= 0.6 + 1e-6
    assert q[0, -1, 0] == pytest.approx(0.6, abs=1e-6)
    assert dq[0, -1, 0] == pytest.approx(0.0, abs=1e-9)
    state = Model(robot).step(Model(robot).start(), [4.0], 1.0)
    assert state.q == pytest.approx(q[0, -1], abs=1e-6)


def test_inertia_of_no_real_body_is_refused_by_pybullet():
    links, joints = parse(ARM, 'arm.urdf')
    bodies = {link.name: link.body for link in links}
    hand = bodies['hand']
    bodies['hand'] = Body(hand.mass, hand.com, (0.001, 0.001, 0.1, 0.0, 0.0, 0.0))
    with pytest.raises(UserError, match='hand'):
        Bullet(ARM, joints, bodies, 9.81)
