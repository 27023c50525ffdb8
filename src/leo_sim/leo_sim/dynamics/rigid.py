# SPDX-License-Identifier: Apache-2.0
"""Rigid-body dynamics of a fixed-base tree on arrays: joint-space inertia and bias torques.

Recursive Newton-Euler and composite rigid bodies in link coordinates (Featherstone, Rigid Body
Dynamics Algorithms, chapters 5 and 6), over any leading axes at once.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.description.urdf import Body, Joint
from leo_sim.dynamics.inertia import Dynamics
from leo_sim.kinematics.frames import (
    add,
    cross,
    dot,
    Frame,
    Mat,
    placed,
    plus,
    product,
    scaled,
    steiner,
    symmetric,
    transposed,
    turned,
    turning_parts,
    UNIT,
    Vec,
    ZERO,
)


class _Motion(NamedTuple):
    """Angular velocity and acceleration, acceleration of the origin, in link axes."""

    speed: Vec
    turn: Vec
    pull: Vec


class _Composite(NamedTuple):
    """Mass, first moment and rotational inertia about the link origin of a subtree."""

    mass: Any
    moment: Vec
    inertia: Mat


class Rigid(Dynamics):
    def __init__(self, joints: Sequence[Joint], bodies: Mapping[str, Body], gravity: Numbers):
        self._joints = list(joints)
        self._bodies = [bodies[joint.child] for joint in joints]
        links = {joint.child: i for i, joint in enumerate(joints)}
        self._parents = [links.get(joint.parent, -1) for joint in joints]
        moving = [i for i, joint in enumerate(joints) if joint.kind != 'fixed']
        self._column = {i: c for c, i in enumerate(moving)}
        self._fixed = [turning_parts(joint) for joint in joints]
        self._gravity = gravity
        self._pulled = any(f.__class__ is not float or f for b in self._bodies for f in b.force)

    def mass_and_bias(self, q: Array, dq: Array) -> tuple[Any, Any]:
        poses, shape = self._poses(q), np.broadcast_shapes(np.shape(q), np.shape(dq))
        return (
            _square(self._inertia(poses), shape),
            joined(self._torques(poses, self._split(dq)), shape),
        )

    def bias(self, q: Array, dq: Array) -> Any:
        torques = self._torques(self._poses(q), self._split(dq))
        return joined(torques, np.broadcast_shapes(np.shape(q), np.shape(dq)))

    def _split(self, values: Any) -> list[Any]:
        return [values[..., column] for column in range(len(self._column))]

    def _poses(self, q: Array) -> list[Frame]:
        """Child link frames in their parents."""
        return [
            placed(joint, parts, q[..., self._column[i]] if i in self._column else 0.0)
            for i, (joint, parts) in enumerate(zip(self._joints, self._fixed, strict=True))
        ]

    def _torques(self, poses: Sequence[Frame], rates: Sequence[Any]) -> list[Any]:
        """Recursive Newton-Euler with zero joint accelerations."""
        forces, moments = [], []
        motions: list[_Motion] = []
        worlds: list[Mat] = []
        base = _Motion(ZERO, ZERO, (0.0, 0.0, self._gravity))
        for i, pose in enumerate(poses):
            parent = self._parents[i]
            motion = self._outward(i, pose, base if parent < 0 else motions[parent], rates)
            motions.append(motion)
            force, moment = _inertial(self._bodies[i], motion)
            if self._pulled:
                worlds.append(product(UNIT if parent < 0 else worlds[parent], pose.rotation))
                outside = turned(transposed(worlds[i]), self._bodies[i].force)
                force = plus(force, scaled(-1.0, outside))
            forces.append(force)
            moments.append(plus(moment, cross(self._bodies[i].com, force)))
        return self._inward(poses, forces, moments)

    def _outward(self, i: int, pose: Frame, parent: _Motion, rates: Sequence[Any]) -> _Motion:
        back = transposed(pose.rotation)
        lever = plus(
            cross(parent.turn, pose.origin), cross(parent.speed, cross(parent.speed, pose.origin))
        )
        speed, turn = turned(back, parent.speed), turned(back, parent.turn)
        pull = turned(back, plus(parent.pull, lever))
        kind = self._joints[i].kind
        if kind == 'fixed':
            return _Motion(speed, turn, pull)
        own = scaled(rates[self._column[i]], self._joints[i].axis)
        if kind == 'prismatic':
            return _Motion(speed, turn, plus(pull, scaled(2.0, cross(speed, own))))
        return _Motion(plus(speed, own), plus(turn, cross(speed, own)), pull)

    def _inward(self, poses: Sequence[Frame], forces: list[Vec], moments: list[Vec]) -> list[Any]:
        """Joint torques from the forces and moments at the link origins."""
        torques: list[Any] = [0.0] * len(self._column)
        for i in range(len(poses) - 1, -1, -1):
            if i in self._column:
                along = forces if self._joints[i].kind == 'prismatic' else moments
                torques[self._column[i]] = dot(self._joints[i].axis, along[i])
            parent = self._parents[i]
            if parent >= 0:
                force = turned(poses[i].rotation, forces[i])
                moment = plus(turned(poses[i].rotation, moments[i]), cross(poses[i].origin, force))
                forces[parent] = plus(forces[parent], force)
                moments[parent] = plus(moments[parent], moment)
        return torques

    def _inertia(self, poses: Sequence[Frame]) -> list[list[Any]]:
        """Lower triangle of the joint-space inertia by composite rigid bodies."""
        composites = [_about_origin(body) for body in self._bodies]
        rows: list[list[Any]] = [[0.0] * (c + 1) for c in range(len(self._column))]
        for i in range(len(poses) - 1, -1, -1):
            if i in self._column:
                self._fill(rows, i, composites[i], poses)
            if self._parents[i] >= 0:
                above = composites[self._parents[i]]
                composites[self._parents[i]] = _merged(above, _moved(composites[i], poses[i]))
        return rows

    def _above(self, i: int) -> list[int]:
        """Indices of the joints between link i's joint and the base."""
        chain = []
        while (i := self._parents[i]) >= 0:
            chain.append(i)
        return chain

    def _fill(
        self, rows: list[list[Any]], i: int, composite: _Composite, poses: Sequence[Frame]
    ) -> None:
        """Row i: force and moment that accelerate the subtree along joint i, at its ancestors."""
        axis, column = self._joints[i].axis, self._column[i]
        if self._joints[i].kind == 'prismatic':
            force, moment = scaled(composite.mass, axis), cross(composite.moment, axis)
            rows[column][column] = dot(axis, force)
        else:
            force, moment = cross(axis, composite.moment), turned(composite.inertia, axis)
            rows[column][column] = dot(axis, moment)
        at = i
        for ancestor in self._above(i):
            force = turned(poses[at].rotation, force)
            moment = plus(turned(poses[at].rotation, moment), cross(poses[at].origin, force))
            at = ancestor
            if at in self._column:
                joint = self._joints[at]
                along = force if joint.kind == 'prismatic' else moment
                low, high = sorted((column, self._column[at]))
                rows[high][low] = dot(joint.axis, along)


def joined(parts: Sequence[Any], shape: tuple[int, ...]) -> Any:
    """Components side by side along the last axis, at least as large as `shape`."""
    if len(parts) == 1 and np.ndim(parts[0]) >= len(shape) - 1:
        return np.asarray(parts[0])[..., None]
    arrays = np.broadcast_arrays(*parts, np.empty(shape[:-1]))[:-1]
    return np.stack(arrays, axis=-1)


def _square(rows: Sequence[Sequence[Any]], shape: tuple[int, ...]) -> Any:
    """The symmetric matrix (..., J, J) of the rows of its lower triangle."""
    size = len(rows)
    entries = [rows[max(i, j)][min(i, j)] for i in range(size) for j in range(size)]
    flat = joined(entries, (*shape[:-1], size * size))
    return flat.reshape(*flat.shape[:-1], size, size)


def _inertial(body: Body, motion: _Motion) -> tuple[Vec, Vec]:
    """Force and moment about the CoM that give a link its motion (gravity as acceleration)."""
    speed, turn = motion.speed, motion.turn
    inertia = symmetric(body.inertia)
    swing = plus(cross(turn, body.com), cross(speed, cross(speed, body.com)))
    force = scaled(body.mass, plus(motion.pull, swing))
    moment = plus(turned(inertia, turn), cross(speed, turned(inertia, speed)))
    return force, moment


def _about_origin(body: Body) -> _Composite:
    moment = scaled(body.mass, body.com)
    inertia = tuple(
        add(i, s)
        for i, s in zip(symmetric(body.inertia), steiner(body.mass, ZERO, body.com), strict=True)
    )
    return _Composite(body.mass, moment, inertia)


def _moved(part: _Composite, pose: Frame) -> _Composite:
    """A composite seen from the parent link."""
    moment = turned(pose.rotation, part.moment)
    inertia = product(product(pose.rotation, part.inertia), transposed(pose.rotation))
    shift = steiner(part.mass, moment, pose.origin)
    return _Composite(
        part.mass,
        plus(moment, scaled(part.mass, pose.origin)),
        tuple(add(i, s) for i, s in zip(inertia, shift, strict=True)),
    )


def _merged(a: _Composite, b: _Composite) -> _Composite:
    return _Composite(
        add(a.mass, b.mass),
        plus(a.moment, b.moment),
        tuple(add(i, j) for i, j in zip(a.inertia, b.inertia, strict=True)),
    )


class Single(Dynamics):
    """The equations of motion of one joint, as `Rigid` has them.

    The rotation of a hinge is linear in the cosine and the sine of its angle, so gravity and
    external forces load it by a + b cos q + c sin q. They load a slide by a constant.
    """

    def __init__(self, joints: Sequence[Joint], bodies: Mapping[str, Body], gravity: Numbers):
        tree = Rigid(joints, bodies, gravity)
        ahead, aside, behind = (tree.load(np.array([a])) for a in (0.0, 0.5 * np.pi, np.pi))
        self._mass = tree.mass_and_bias(np.zeros(1), np.zeros(1))[0]
        self._mean, self._cosine = 0.5 * (ahead + behind), 0.5 * (ahead - behind)
        self._sine = aside - self._mean

    def mass_and_bias(self, q: Array, dq: Array) -> tuple[Any, Any]:
        return self._mass, -self.load(q)

    def load(self, q: Array) -> Any:
        return self._mean + self._cosine * np.cos(q) + self._sine * np.sin(q)
