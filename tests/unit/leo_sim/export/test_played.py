# SPDX-License-Identifier: Apache-2.0
"""Plain MuJoCo plays an exported model as the model itself moves."""

from dataclasses import replace

import numpy as np
import pytest
from tests.models import modelled, stepped

from leo_sim.export.held import held
from leo_sim.export.mjcf import mjcf
from leo_sim.model import Model
from leo_sim.references.mjcf import written

mujoco = pytest.importorskip('mujoco')
CLOSE = 0.01  # largest error of a joint's angle or rate, rms, as a share of how much it moves
SETTLED = 5  # control periods until late sensors have seen anything
FRICTION = (('viscous_friction', {'b': 0.01}), ('coulomb_friction', {'c': 0.02}))
MOTOR = (('torque_scale', {'k': 0.8}), ('armature', {'J': 0.002}))
SPRING = (('joint_spring', {'k': 0.2, 'rest': 0.4}), ('encoder_offset', {'o': 0.1}))
VOLTS = (('back_emf_scale', {'k': 1.4}), ('voltage_scale', {'k': 0.9}))
SLOW = (('actuator_lag', {'tau': 0.03}), ('bias_torque', {'t': 0.02}))
LATE = (('command_delay', {'delay': 0.0432}), ('quadratic_drag', {'d': 1e-3}))
SENSED = (('measurement_delay', {'delay': 0.025}), ('encoder_offset', {'o': 0.1}))
LIMIT = (('voltage_limit', {'v': 3.0}),)
BODY = (('link_mass', {'m': 0.2}), ('link_com', {'x': 0.01}), ('link_inertia', {'I': 0.002}))
SINGLE = {
    'pendulum': (
        FRICTION[:0],
        (('viscous_friction', {'b': 1e-5}),),
        (('coulomb_friction', {'c': 5e-4}), ('armature', {'J': 5e-5})),
        VOLTS,
    ),
    'servo_pendulum': (FRICTION, MOTOR, SPRING, VOLTS, SLOW, LATE, LIMIT, BODY),
    'torque_pendulum': (FRICTION, MOTOR, SPRING, SLOW, (*LATE, *SLOW), SENSED),
    'xl330_pendulum': (FRICTION, MOTOR, SPRING, VOLTS, (*LATE, ('goal_rate', {'rate': 2.0}))),
}
CASES = [(robot, effects) for robot, all_of in SINGLE.items() for effects in all_of]


def commands(model, count, share):
    """Steps that hold for 0.1 s each, `share` of the largest input."""
    rng = np.random.default_rng(3)
    hold = max(1, round(0.1 / model.robot.control_period))
    steps = rng.uniform(-1, 1, (count // hold + 1, len(model.robot.actuators)))
    return share * np.repeat(steps, hold, axis=0)[:count] * np.abs(model.robot.bounds).min(axis=0)


def by_model(model, state, inputs):
    return np.concatenate(stepped(model, inputs, model.robot.control_period, state), axis=1)[1:]


def by_mujoco(model, state, inputs, held_base=False):
    loaded = mujoco.MjModel.from_xml_string(written(mjcf(held(model, 'MJCF').model)))
    at = [loaded.joint(name).qposadr[0] for name in model.robot.joint_names]
    if held_base:
        loaded.dof_armature[at[:3]] = 1e4
    data = mujoco.MjData(loaded)
    data.qpos[at], data.qvel[at] = model.sense(state)
    each = round(model.robot.control_period / loaded.opt.timestep)
    read = []
    for u in inputs:
        data.ctrl[:] = u
        mujoco.mj_step(loaded, data, nstep=each)
        read.append(np.r_[data.qpos[at], data.qvel[at]])
        for i in range(loaded.nsensor):
            read[-1][i] = mujoco.mj_readSensor(loaded, data, i, data.time, np.empty(1), 1)[0]
    return np.array(read)


def apart(ours, theirs):
    moved = np.maximum(np.std(ours, axis=0), 1e-3 * np.std(ours, axis=0).max())
    return float(np.max(np.sqrt(np.mean((theirs - ours) ** 2, axis=0)) / moved))


@pytest.mark.parametrize(
    ('robot', 'effects'),
    CASES,
    ids=lambda value: (
        value if isinstance(value, str) else '+'.join(name for name, _ in value) or 'ideal'
    ),
)
def test_one_joint(robot, effects):
    model = modelled(robot, *effects, engine='rigid')
    state = model.state_from([0.6], [0.0])
    inputs = commands(model, round(2.0 / model.robot.control_period), 0.5)
    assert not [line for line in held(model, 'MJCF').left_out if ' at ' in line]
    ours, theirs = by_model(model, state, inputs), by_mujoco(model, state, inputs)
    assert apart(ours[SETTLED:], theirs[SETTLED:]) < CLOSE


def test_two_joints():
    effects = [
        ('viscous_friction', {'b': 0.01}),
        ('coulomb_friction', {'c': 0.05}),
        ('armature', {'J': 0.005}),
        ('joint_spring', {'k': 0.5}),
        ('link_mass', {'m': 0.1}),
        ('torque_scale', {'k': 0.8}),
    ]
    model = modelled('double_pendulum', *effects, engine='rigid')
    state = model.state_from([0.5, -0.3], [0.0, 0.0])
    inputs = commands(model, round(1.0 / model.robot.control_period), 0.3)
    assert apart(by_model(model, state, inputs), by_mujoco(model, state, inputs)) < CLOSE


def test_leo_hanging():
    robot = Model('leo').robot
    legs = [name for name in robot.joint_names if name.startswith(('left', 'right'))]
    effects = [
        ('viscous_friction', legs, {'b': 0.05}),
        ('coulomb_friction', legs, {'c': 0.05}),
        ('back_emf_scale', legs, {'k': 1.2}),
        ('link_mass', 'torso', {'m': 0.3}),
    ]
    model = modelled(robot, *effects, engine='rigid', scheme='search', held=True)
    state = replace(model.start('hanging'), q=np.array([0, 0.6, 0, 0.3, 0.2, -0.7, -0.9, 0, 0]))
    inputs = commands(model, round(1.0 / robot.control_period), 0.3)
    theirs = by_mujoco(model, state, inputs, held_base=True)
    assert apart(by_model(model, state, inputs)[:, 3:9], theirs[:, 3:9]) < CLOSE
