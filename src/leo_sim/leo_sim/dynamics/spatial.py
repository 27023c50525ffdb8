# SPDX-License-Identifier: Apache-2.0
"""Rigid-body dynamics of a fixed-base tree in space: the compiled recursion, on arrays."""

from collections.abc import Mapping, Sequence
import math
from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, common, Numbers, rows
from leo_sim.description.joint import columns, Joint
from leo_sim.description.urdf import Body
from leo_sim.dynamics.free_motion import Stateless
from leo_sim.dynamics.impulses import Factor
from leo_sim.dynamics.planar import KINDS
from leo_sim.dynamics.tree_kernel import dynamics, FIGURES, kick, Tree
from leo_sim.kinematics.frames import turning_parts


class Spatial(Stateless):
    """The numbers of `leo_sim.dynamics.rigid.Rigid`, compiled.

    Attributes:
        tree: Geometry, for the compiled functions.
        world: Inertial figures (S, L, FIGURES) and gravity (S,) for them.
        leading: Axes of the states that these serve: (S, 1), (W,) or (S, W); () for one.

    Args:
        joints: Of the robot, parents first.
        bodies: Inertial figures by link; floats, or arrays (S, 1) that scan S values, (W,) or
            (S, W) of W windows that differ.
        gravity: m/s2; the same.
    """

    def __init__(self, joints: Sequence[Joint], bodies: Mapping[str, Body], gravity: Any):
        self.tree = _tree(joints)
        figures, gravity = _figures([bodies[joint.child] for joint in joints], gravity)
        self.leading = gravity.shape if gravity.size > 1 else ()
        self.world = figures.reshape(-1, len(joints), FIGURES), gravity.reshape(-1)

    def mass_and_bias(self, q: Array, dq: Array) -> tuple[Any, Any]:
        """Joint-space inertia (..., J, J) and bias torques (..., J); see `Rigid`."""
        shape, size = self._leading(q, dq), np.shape(q)[-1]
        mass = np.empty((math.prod(shape), size, size))
        bias = self._filled(shape, q, dq, mass)
        return mass.reshape(*shape, size, size), bias

    def bias(self, q: Array, dq: Array) -> Any:
        """The bias torques alone, (..., J)."""
        size = np.shape(q)[-1]
        return self._filled(self._leading(q, dq), q, dq, np.empty((0, size, size)))

    def load(self, q: Array) -> Any:
        """Torque of gravity and external forces at the joints, N m, (..., J), along +q."""
        return -self.bias(q, np.zeros_like(q))

    def kicked(
        self, q: Array, dq: Array, diagonal: Array, driving: Array, held: Array, h: Numbers
    ) -> tuple[Any, Factor]:
        """See `Free`; here all at once."""
        size, h = q.shape[-1], np.asarray(h)
        shape = common(
            self._leading(q, dq),
            diagonal.shape[:-1],
            driving.shape[:-1],
            held.shape[:-1],
            h.shape[:-1],
        )
        states = rows(q, shape, size, True), rows(dq, shape, size, True)
        given = rows(diagonal, shape, size), rows(driving, shape, size), rows(held, shape, size)
        inverse, rates = np.empty((math.prod(shape), size, size)), np.empty(states[1].shape)
        kick(
            self.tree,
            *self.world,
            self.each(shape),
            *states,
            *given,
            rows(h, shape, 1),
            inverse,
            rates,
        )
        return rates.reshape(*shape, size), Factor.of(inverse.reshape(*shape, size, size))

    def each(self, shape: tuple[int, ...]) -> int:
        """How many states in a row, of those with such leading axes, have the same figures."""
        inner = 0
        while inner < len(self.leading) and self.leading[-1 - inner] == 1:
            inner += 1
        return math.prod(shape[len(shape) - inner :] if self.leading else shape)

    def _leading(self, q: Array, dq: Array) -> tuple[int, ...]:
        """Leading axes of what is computed for such states."""
        return common(np.shape(q)[:-1], np.shape(dq)[:-1], self.leading)

    def _filled(self, shape: tuple[int, ...], q: Array, dq: Array, mass: Array) -> Any:
        """The bias torques; fills the inertia too unless it has no rows."""
        size = np.shape(q)[-1]
        states = rows(q, shape, size, True), rows(dq, shape, size, True)
        bias = np.empty(states[0].shape)
        dynamics(self.tree, *self.world, self.each(shape), *states, mass, bias)
        return bias.reshape(*shape, size)


def _tree(joints: Sequence[Joint]) -> Tree:
    links = {joint.child: i for i, joint in enumerate(joints)}
    return Tree(
        np.array([KINDS[j.kind] for j in joints]),
        np.array([links.get(j.parent, -1) for j in joints]),
        np.array(columns(joints)),
        np.array([j.ratio for j in joints]),
        np.array([turning_parts(j) for j in joints], dtype=float),
        np.array([j.translation for j in joints], dtype=float),
        np.array([j.axis for j in joints], dtype=float),
    )


def _figures(bodies: Sequence[Body], gravity: Any) -> tuple[Any, Any]:
    """Mass, CoM, inertia (xx yy zz xy xz yz) and force of each link, (..., L * 13); gravity."""
    figures = (x for b in bodies for x in (b.mass, *b.com, *b.inertia, *b.force))
    *parts, down = np.broadcast_arrays(
        *(np.asarray(x, dtype=float) for x in figures), np.asarray(gravity, dtype=float)
    )
    return np.stack(parts, axis=-1), down.copy()
