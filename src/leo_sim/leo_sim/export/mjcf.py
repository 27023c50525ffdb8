# SPDX-License-Identifier: Apache-2.0
"""A model as MJCF, with motors, friction, springs and encoders' zeros."""

from itertools import product
import math
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from leo_sim.description.robot import Robot
from leo_sim.description.urdf import numbers, with_bodies
from leo_sim.export.figures import Figures, figures, loop_gains, nominal, refuse_mimics, strengths
from leo_sim.model.model import Model
from leo_sim.references.mjcf import hard_figures, tree

STEP = 0.0005  # longest time step that is written, s


def mjcf(model: Model) -> Element:
    """A model whose laws are straight lines (see `held`) as MJCF; UserError: none that MJCF holds.

    Its numbers are radians, N m and the inputs of the robot; `qpos` is what the encoders read
    (sensors, where they are late), `ctrl` the commands in the order of the actuators.
    """
    robot, found = model.robot, figures(model)
    refuse_mimics(robot, 'MJCF')
    laws = found.laws
    with_bodies(robot.urdf, laws.bodies)  # refuses what no body has
    root = tree(robot, laws)
    root.set('model', robot.name)
    step = robot.control_period / math.ceil(robot.control_period / STEP)
    option = root.find('option')
    assert option is not None
    option.set('timestep', repr(step))
    if not robot.contacts:  # where nothing hits a ground the fourth order pays
        option.set('integrator', 'RK4')
    _joints(root, robot, found, step)
    for pair in root.iter('pair'):
        pair.set('friction', numbers([laws.ground.friction] * 2 + [0.005, 0.0001, 0.0001]))
    actuators = SubElement(root, 'actuator')
    for i, actuator in enumerate(robot.actuators):
        attributes = _servo if robot.input == 'position' else _motor
        tag, values = attributes(robot, found, i)
        values |= _late(found.drives.delay[i], step)
        SubElement(actuators, tag, {'name': actuator.joint, 'joint': actuator.joint, **values})
    sensors, late = SubElement(root, 'sensor'), _late(found.late, step)
    for joint, of in product(robot.joint_names, ('pos', 'vel') if late else ()):
        values = {'name': f'{joint}_{of}', 'joint': joint, 'interp': 'linear', **late}
        SubElement(sensors, f'joint{of}', values)
    _start(root, robot, found)
    return root


def _joints(root: Element, robot: Robot, found: Figures, step: float) -> None:
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
            'damping': (damping[i], *found.drag[:, i]),
            'frictionloss': found.friction[i],
            'stiffness': found.stiffness[i],
            'springref': found.rest[i] + zero if found.stiffness[i] else 0.0,
            'ref': zero,
        }
        for key, value in values.items():
            if text := numbers(np.trim_zeros(np.atleast_1d(value), 'b')):
                element.set(key, text)
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
    drive, most = found.drives, strengths(robot, found)[i]
    low, high = robot.bounds[:, i]
    kp, kv, rate = (gains[i] for gains in loop_gains(found))
    tag, values = 'position', {'kp': kp, 'kv': kv}
    if drive.lag[i]:
        values['timeconst'] = drive.lag[i]
    if math.isfinite(rate):
        tag, values['slewmax'] = 'pid', rate
    return tag, {
        **({'input': 'pos'} if tag == 'pid' else {}),
        'ctrllimited': 'true',
        'ctrlrange': numbers((low, high)),
        'forcelimited': 'true',
        'forcerange': numbers((-most, most)),
        **{k: repr(float(v)) for k, v in values.items()},
    }


def _late(delay: float, step: float) -> dict[str, Any]:
    """A delay s with room for it, also at half the time step."""
    room = str(2 * math.ceil(delay / step) + 1)
    return {'delay': repr(float(delay)), 'nsample': room} if delay else {}


def _start(root: Element, robot: Robot, found: Figures) -> None:
    angles = nominal(robot)
    if angles is None:
        return
    names = [element.get('name', '') for element in root.iter('joint')]
    zeros = dict(zip(robot.joint_names, found.zero.tolist(), strict=True))
    qpos = numbers([angles.get(name, 0.0) + zeros[name] for name in names])
    SubElement(SubElement(root, 'keyframe'), 'key', name='nominal', qpos=qpos)
