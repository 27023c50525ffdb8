# SPDX-License-Identifier: Apache-2.0
"""A model as MJCF, with motors, friction, springs and encoders' zeros, or as URDF, with less.

The figures of its laws, which are straight lines, are read off the laws themselves.
"""

from dataclasses import dataclass
import math
from typing import Any
from xml.etree import ElementTree

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.description.urdf import put_bodies, with_bodies
from leo_sim.export.held import slope_and_end
from leo_sim.laws.laws import Laws
from leo_sim.model.model import Model
from leo_sim.references.mjcf import added, hard_figures, numbers, tree

LAG = 'actuator_lag'
STEP = 0.0005  # longest time step that is written, s


@dataclass(frozen=True)
class Drives:
    """Of each actuator, (A,); the torque is gain u + bias - back_emf w."""

    gain: Any  # N m per unit of what is on the motor, V or N m
    back_emf: Any  # N m s/rad
    bias: Any  # N m
    most: Any  # on the motor, V or N m
    scale: Any  # what is on the motor for a command of 1 V or N m
    lag: Any  # time constant of the command, s; 0 for none


@dataclass(frozen=True)
class Figures:
    """Of each joint, (J,), without its actuator."""

    armature: Any  # kg m2
    damping: Any  # N m s/rad
    friction: Any  # N m
    stiffness: Any  # N m/rad
    rest: Any  # of the spring, rad
    zero: Any  # what the encoder reads at angle 0, rad
    drives: Drives
    laws: Laws


def mjcf(model: Model) -> ElementTree.Element:
    """A model whose laws are straight lines (see `held`) as MJCF; UserError: none that MJCF holds.

    Its numbers are radians, N m and the inputs of the robot; `qpos` is what the encoders read,
    `ctrl` the commands in the order of the actuators.
    """
    robot, found = model.robot, figures(model)
    if robot.copies:
        raise UserError(
            f'{robot.name}: joint {robot.copies[0]!r} mimics another, which the MJCF '
            'written here does not hold; write a .urdf'
        )
    laws = found.laws
    with_bodies(robot.urdf, laws.bodies)  # refuses what no body has
    root = tree(robot, laws)
    root.set('model', robot.name)
    step = robot.control_period / math.ceil(robot.control_period / STEP)
    option = root.find('option')
    assert option is not None
    option.set('timestep', repr(step))
    _joints(root, robot, found, step)
    for pair in root.iter('pair'):
        pair.set('friction', numbers([laws.ground.friction] * 2 + [0.005, 0.0001, 0.0001]))
    actuators = added(root, 'actuator')
    for i, actuator in enumerate(robot.actuators):
        attributes = _servo if robot.input == 'position' else _motor
        tag, values = attributes(robot, found, i)
        added(actuators, tag, name=actuator.joint, joint=actuator.joint, **values)
    _start(root, robot, found)
    return root


def _joints(root: ElementTree.Element, robot: Robot, found: Figures, step: float) -> None:
    """Passive figures of the joints; stops and dry friction as hard as the time step allows."""
    damping = found.damping.copy()
    if robot.input == 'position':
        damping[list(robot.actuated)] += found.drives.back_emf
    reference, impedance = hard_figures(step)
    hard = {f'solref{of}': numbers(reference) for of in ('limit', 'friction')}
    hard |= {f'solimp{of}': numbers(impedance) for of in ('limit', 'friction')}
    for element in root.iter('joint'):
        i = robot.joint_names.index(element.get('name', ''))
        zero = float(found.zero[i])
        if element.get('range'):
            low, high = (float(end) + zero for end in element.get('range', '').split())
            element.set('range', numbers((low, high)))
        values = {
            'armature': found.armature[i],
            'damping': damping[i],
            'frictionloss': found.friction[i],
            'stiffness': found.stiffness[i],
            'springref': found.rest[i] + zero if found.stiffness[i] else 0.0,
            'ref': zero,
        }
        for key, value in values.items():
            if value:
                element.set(key, repr(float(value)))
        for key, text in hard.items():
            if element.get('range' if 'limit' in key else 'frictionloss'):
                element.set(key, text)


def _motor(robot: Robot, found: Figures, i: int) -> tuple[str, dict[str, str]]:
    """A motor on V or N m: torque = gain x command + bias - back-EMF x speed."""
    drive = found.drives
    scale, most = drive.scale[i], robot.limits[i]
    limit = min(most, drive.most[i] / scale) if scale else most
    values = {
        'ctrllimited': 'true',
        'ctrlrange': numbers((-limit, limit)),
        'gaintype': 'fixed',
        'gainprm': numbers([drive.gain[i] * scale]),
        'biastype': 'affine',
        'biasprm': numbers((drive.bias[i], 0.0, -drive.back_emf[i])),
    }
    if drive.lag[i]:
        values |= {'dyntype': 'filterexact', 'dynprm': numbers([drive.lag[i]])}
    return 'general', values


def _servo(robot: Robot, found: Figures, i: int) -> tuple[str, dict[str, str]]:
    """A position servo: duty x supply on its motor, whose back-EMF is damping of the joint."""
    drive, loop = found.drives, found.laws.servos
    assert loop is not None
    gain, rate_gain, _, supply = (np.broadcast_to(f, drive.gain.shape)[i] for f in loop.loop)
    each = drive.gain[i] * drive.scale[i] * supply
    most = drive.gain[i] * drive.most[i]
    low, high = robot.bounds[:, i]
    values = {'kp': each * gain, 'kv': each * rate_gain}
    if drive.lag[i]:
        values['timeconst'] = drive.lag[i]
    return 'position', {
        'ctrllimited': 'true',
        'ctrlrange': numbers((low, high)),
        'forcelimited': 'true',
        'forcerange': numbers((-most, most)),
        **{k: repr(float(v)) for k, v in values.items()},
    }


def _start(root: ElementTree.Element, robot: Robot, found: Figures) -> None:
    """The nominal start pose as a key frame, where it is one pose."""
    angles: dict[str, Any] = robot.start_poses['nominal'].angles
    if any(isinstance(angle, tuple) for angle in angles.values()):
        return
    names = [element.get('name', '') for element in root.iter('joint')]
    zeros = dict(zip(robot.joint_names, found.zero.tolist(), strict=True))
    qpos = numbers([angles.get(name, 0.0) + zeros[name] for name in names])
    added(added(root, 'keyframe'), 'key', name='nominal', qpos=qpos)


def urdf(model: Model) -> ElementTree.Element:
    """A model whose laws URDF holds (see `held`), shapes as in its robot's own URDF."""
    root, found = ElementTree.fromstring(model.robot.urdf), figures(model)
    put_bodies(root, {name: b for name, b in found.laws.bodies.items() if b.mass})
    for joint in root.findall('joint'):
        for old in joint.findall('dynamics'):
            joint.remove(old)
        if joint.get('name') in model.robot.joint_names:
            i = model.robot.joint_names.index(joint.get('name', ''))
            damping, friction = float(found.damping[i]), float(found.friction[i])
            if damping or friction:
                added(joint, 'dynamics', damping=repr(damping), friction=repr(friction))
    _limits(root, model, found)
    return root


def _limits(root: ElementTree.Element, model: Model, found: Figures) -> None:
    """Torque at rest and speed without load of motors; of torque inputs the largest one."""
    robot, drive = model.robot, found.drives
    joints = {joint.get('name'): joint for joint in root.findall('joint')}
    for i, actuator in enumerate(robot.actuators):
        most = actuator.strongest if robot.input == 'position' else actuator.limit
        figures_of = {'effort': drive.gain[i] * np.minimum(most, drive.most[i])}
        if robot.has_motor_law:
            figures_of['velocity'] = figures_of['effort'] / drive.back_emf[i]
        joint = joints[actuator.joint]
        limit = joint.find('limit')
        if limit is None and robot.has_motor_law:
            limit = ElementTree.SubElement(joint, 'limit')
        if limit is not None:
            for key, value in figures_of.items():
                limit.set(key, repr(float(value)))


def figures(model: Model) -> Figures:
    """The figures of a model whose laws are straight lines (see `held`)."""
    laws = model.changed(effects=[p for p in model.effects if p.effect.name != LAG]).laws
    still, nothing = np.zeros(len(laws.joints)), np.zeros(len(laws.actuated_joints))

    def joint(q: float, dq: float) -> Any:
        off, rates = nothing.astype(bool), still + dq
        return still + laws.torques(still + q, rates, rates, nothing, off, still).joint

    at_rest = joint(0.0, 0.0)
    stiffness = at_rest - joint(1.0, 0.0)
    level = laws.torques(still, still, still, nothing, None, still).level
    sprung = stiffness > 0
    rest = np.where(sprung, at_rest / np.where(sprung, stiffness, 1.0), 0.0)
    bias = np.where(sprung, 0.0, at_rest)[laws.actuated]
    return Figures(
        still + laws.rotor_inertia,
        at_rest - joint(0.0, 1.0),
        still if level is None else level,
        stiffness,
        rest,
        laws.sense(still, still, {})[0],
        _drives(model, laws, bias),
        laws,
    )


def _drives(model: Model, laws: Laws, bias: Any) -> Drives:
    """Straight lines of the motors, whatever makes their input (a goal, of servos)."""
    robot, motors = model.robot, laws.straight
    still, ones = np.zeros(len(laws.joints)), np.ones(len(laws.actuated_joints))

    def motor(u: float, dq: float) -> Any:
        torque = motors.torques(still, still, still + dq, u * ones, None, still).motor
        return (still + torque)[laws.actuated]

    strongest = np.array([a.strongest for a in robot.actuators])
    scale, most = slope_and_end(
        lambda share: motors.command(share * strongest, None, {}, 1.0)[0], 1.0
    )
    lag = np.zeros(len(ones))
    for placed in model.effects:
        if placed.effect.name == LAG:
            lag[[a.joint in placed.where for a in robot.actuators]] = placed.parameters['tau']
    zero = motor(0.0, 0.0)
    return Drives(
        motor(1.0, 0.0) - zero, zero - motor(0.0, 1.0), bias, most, scale / strongest, lag
    )
