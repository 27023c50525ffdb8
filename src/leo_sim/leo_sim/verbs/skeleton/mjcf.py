# SPDX-License-Identifier: Apache-2.0
"""An MJCF of a robot with a fixed or a planar base, as MuJoCo compiles it, turned to a URDF."""

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, indent, SubElement, tostring

import numpy as np
from scipy.spatial.transform import Rotation

from leo_msgs_py.errors import UserError
from leo_sim.description.joint import sliding
from leo_sim.description.urdf import inertial, numbers, rpy
from leo_sim.references import load_mujoco
from leo_sim.verbs.skeleton.description import Description

FREE, BALL, SLIDE = 0, 1, 2  # mjtJoint
OF_JOINT = 0  # mjtTrn
LAGS, KNOWN, OF_PID = (2, 3), (0, 2, 3, 6), 5  # mjtDyn, mjtDyn, mjtGain
OF_STATES = 9, 10  # mjtSensor
LIGHT = 1e-6
"""Mass of a link between two joints of one body, kg; its inertia is as many times smaller."""
PLANAR = ((1, 0, 0), (0, 0, 1), (0, 1, 0))  # axes of the joints of a planar base


def read_mjcf(path: Path, name: str) -> Description:
    model = load_mujoco('an MJCF').compiled(path)
    for i in np.flatnonzero(model.jnt_type < SLIDE).tolist():
        kind = {FREE: 'free', BALL: 'a ball'}[int(model.jnt_type[i])]
        raise UserError(
            f'{path}: joint {_joint(model, i)!r} is {kind}; a robot here has a '
            'fixed base, or a planar one of two slides and a hinge'
        )
    root = Element('robot', name=name)
    zeros = {0: np.zeros(3)}
    SubElement(root, 'link', name=_link(model, 0))
    for body in range(1, model.nbody):
        zeros[body] = _add_body(root, model, body, zeros[int(model.body_parentid[body])])
    motors = _motors(model)
    indent(root)
    names = [_joint(model, j) for j in range(model.njnt)]
    dry, rotor = model.dof_frictionloss[model.jnt_dofadr], model.dof_armature[model.jnt_dofadr]
    return Description(
        name=name,
        text=tostring(root, encoding='unicode') + '\n',
        efforts={names[j]: most for j, i in motors.items() if (most := _effort(model, i))},
        speeds={},
        frictions={name: f'{c:g}' for name, c in zip(names, dry, strict=True) if c},
        notes=tuple(_notes(model, motors)),
        rotors={names[j]: float(rotor[j]) for j in motors if rotor[j]},
        loops={names[j]: loop for j, loop in _loops(model, motors).items()},
        effects={(effect, at): p for effect, at, p in _effects(model, names, motors)},
        motors=frozenset(names[j] for j in motors) or None,
        base='planar' if _planar(model, motors) else 'fixed',
        gravity=float(np.linalg.norm(model.opt.gravity)),
    )


def _add_body(root: Element, model: Any, body: int, above: Any) -> Any:
    """Add a body's link, with a light one for each joint but the last; return its link's origin.

    A link has its origin at its joint, a body where it likes: `above` is where the link of the
    parent has it in that body's own frame, m.
    """
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    turned = Rotation.from_quat(model.body_quat[body], scalar_first=True)
    parent, at = _link(model, int(model.body_parentid[body])), np.zeros(3)
    place = model.body_pos[body] - above
    for joint in range(first, first + count):
        last = joint == first + count - 1
        child = _link(model, body) if last else f'{_joint(model, joint)}_link'
        there = model.jnt_pos[joint]
        place = place + turned.apply(there - at)
        _add_joint(root, model, joint, (parent, child), place, turned)
        parent, at, turned, place = child, there, Rotation.identity(), np.zeros(3)
        if not last:
            _add_link(root, child, LIGHT, at * 0, np.full(3, LIGHT**2), Rotation.identity())
    if not count:
        _add_joint(root, model, None, (parent, _link(model, body)), place, turned)
    axes = Rotation.from_quat(model.body_iquat[body], scalar_first=True)
    mass, com = model.body_mass[body], model.body_ipos[body] - at
    _add_link(root, _link(model, body), mass, com, model.body_inertia[body], axes)
    return at


def _add_joint(
    root: Element,
    model: Any,
    joint: int | None,
    ends: tuple[str, str],
    place: Any,
    turned: Rotation,
) -> None:
    if joint is None:
        element = SubElement(root, 'joint', name=f'{ends[1]}_fixed', type='fixed')
    else:
        limited, sliding = bool(model.jnt_limited[joint]), model.jnt_type[joint] == SLIDE
        kind = 'prismatic' if sliding else 'revolute' if limited else 'continuous'
        element = SubElement(root, 'joint', name=_joint(model, joint), type=kind)
        SubElement(element, 'axis', xyz=numbers(model.jnt_axis[joint]))
        damping = float(model.dof_damping[model.jnt_dofadr[joint]])
        SubElement(element, 'dynamics', damping=repr(damping))
        if limited:
            low, high = model.jnt_range[joint] - _zero(model, joint)
            SubElement(element, 'limit', lower=repr(float(low)), upper=repr(float(high)))
    for tag, link in zip(('parent', 'child'), ends, strict=True):
        SubElement(element, tag, link=link)
    SubElement(element, 'origin', xyz=numbers(place), rpy=numbers(rpy(turned.as_matrix())))


def _add_link(
    root: Element, name: str, mass: float, com: Any, moments: Any, turned: Rotation
) -> None:
    element = SubElement(root, 'link', name=name)
    if mass:
        element.append(inertial(mass, com, moments, turned.as_matrix()))


def _motors(model: Any) -> dict[int, int]:
    found: dict[int, int] = {}
    for i in range(len(model.actuator_trntype)):
        if model.actuator_trntype[i] == OF_JOINT:
            found.setdefault(int(model.actuator_trnid[i, 0]), i)
    return found


def _effects(
    model: Any, names: list[str], motors: dict[int, int]
) -> Iterator[tuple[str, str, dict[str, float]]]:
    for j, name in enumerate(names):
        if stiffness := model.jnt_stiffness[j]:
            rest = model.qpos_spring[model.jnt_qposadr[j]] - _zero(model, j)
            yield 'joint_spring', name, {'k': stiffness, 'rest': rest}
        if (drag := model.dof_dampingpoly[model.jnt_dofadr[j], 0]) > 0:
            yield 'quadratic_drag', name, {'d': drag}
    for j, i in motors.items():
        if (delay := model.actuator_delay[i]) > 0:
            yield 'command_delay', names[j], {'delay': delay}
        if model.actuator_dyntype[i] in LAGS:
            yield 'actuator_lag', names[j], {'tau': model.actuator_dynprm[i, 0]}
    if late := _late(model):
        yield 'measurement_delay', 'all', {'delay': late}


def _late(model: Any) -> float:
    """The delay that the sensors of all joints share, s; 0 where they do not."""
    seen = {*zip(model.sensor_type.tolist(), model.sensor_objid.tolist(), strict=True)}
    whole = seen == {*product(OF_STATES, range(model.njnt))} and not np.ptp(model.sensor_delay)
    return max(float(model.sensor_delay[0]), 0.0) if whole else 0.0


def _is_servo(model: Any, i: int) -> bool:
    return bool(model.actuator_biastype[i] and model.actuator_biasprm[i].any())


def _loops(model: Any, motors: dict[int, int]) -> dict[int, tuple[float, float, float, float]]:
    """What `Description.loops` has, by number of the joint; nothing where a motor is no servo."""
    found = {}
    for joint, i in motors.items():
        gain = model.actuator_gainprm[i, 0]
        shift, by_angle, by_rate = model.actuator_biasprm[i, :3]
        if pid := model.actuator_gaintype[i] == OF_PID:
            gain = 0.0 if gain else -by_angle  # its own is that of the integral
        if not (gain > 0 and np.isclose(by_angle, -gain) and shift == 0):
            return {}
        gear = abs(float(model.actuator_gear[i, 0]))
        furthest = np.abs(model.actuator_ctrlrange[i]).max() * bool(model.actuator_ctrllimited[i])
        rate = model.actuator_dynprm[i, 1] if pid else 0.0
        gains = float(gain * gear**2), float(-by_rate * gear**2)
        found[joint] = *gains, float(furthest / gear), float(rate / gear)
    return found


def _strength(model: Any, i: int) -> float:
    """Torque at its joint for a `ctrl` of 1, of an actuator that is no servo, N m (N)."""
    return float(model.actuator_gainprm[i, 0] * model.actuator_gear[i, 0])


def _effort(model: Any, i: int) -> float:
    """Largest torque of an actuator, N m (N); 0 where the file does not say."""
    gear = abs(float(model.actuator_gear[i, 0]))
    most = []
    if model.actuator_forcelimited[i]:
        most.append(float(np.max(np.abs(model.actuator_forcerange[i]))) * gear)
    if model.actuator_ctrllimited[i] and not _is_servo(model, i):
        range_of = float(np.max(np.abs(model.actuator_ctrlrange[i])))
        most.append(abs(_strength(model, i)) * range_of)
    joint = int(model.actuator_trnid[i, 0])
    if model.jnt_actfrclimited[joint]:
        most.append(float(np.max(np.abs(model.jnt_actfrcrange[joint]))))
    return min(most, default=0.0)


def _planar(model: Any, motors: dict[int, int]) -> bool:
    kinds = [int(kind) for kind in model.jnt_type[:3]]
    aligned = model.njnt >= 3 and np.allclose(np.abs(model.jnt_axis[:3]), PLANAR)
    return kinds[:2] == [SLIDE, SLIDE] and bool(aligned) and not {0, 1, 2} & {*motors}


def _notes(model: Any, motors: dict[int, int]) -> Iterator[str]:
    counts = {
        'geoms': model.ngeom,
        'equality constraints': model.neq,
        'tendons': model.ntendon,
        'sensors': 0 if _late(model) else model.nsensor,
        'further powers of damping': np.count_nonzero(model.dof_dampingpoly[:, 1]),
        'further powers of stiffness': np.count_nonzero(model.jnt_stiffnesspoly),
        'key frames': model.nkey,
        'actuators that are not of a joint of their own': len(model.actuator_gear) - len(motors),
        'dynamics of actuators': np.count_nonzero(~np.isin(model.actuator_dyntype, KNOWN)),
    }
    gone = [f'{count} {what}' for what, count in counts.items() if count]
    servos = [_joint(model, j) for j, i in motors.items() if _is_servo(model, i)]
    loops = _loops(model, motors)
    if servos and not loops:
        gone.append(f'the gain and bias of the actuators of {", ".join(servos)}')
    if gone:
        yield f'not taken over from the MJCF: {", ".join(gone)}'
    for j, i in motors.items():
        one = 1 / model.actuator_gear[i, 0] if j in loops else _strength(model, i)
        if one != 1 and (j in loops or not _is_servo(model, i)):
            unit = 'rad' if j in loops else 'N m'
            unit = sliding(unit) if model.jnt_type[j] == SLIDE else unit
            yield f'a ctrl of 1 in the MJCF is {one:g} {unit} at {_joint(model, j)} here'
    for joint in range(model.njnt):
        if zero := _zero(model, joint):
            yield (
                f'{_joint(model, joint)} has its angle 0 where the MJCF has its ref, {zero:g}; '
                f'an encoder that reads that has it as sensors.{_joint(model, joint)}.offset'
            )
    x, y, z = model.opt.gravity
    if x or y or z > 0:
        yield 'gravity points elsewhere than down in the MJCF; here it is down'


def _zero(model: Any, joint: int) -> float:
    return float(model.qpos0[model.jnt_qposadr[joint]])


def _link(model: Any, body: int) -> str:
    return str(model.body(body).name) or f'body_{body}'


def _joint(model: Any, joint: int) -> str:
    return str(model.joint(int(joint)).name) or f'joint_{joint}'
