# SPDX-License-Identifier: Apache-2.0
"""Rigid-body dynamics of a fixed-base tree in space: the compiled recursion, on arrays."""

from collections.abc import Mapping, Sequence
import math
from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, common, Numbers, rows
from leo_sim.common.compiled import compiled_without_gil
from leo_sim.description.joint import columns, Joint
from leo_sim.description.urdf import Body
from leo_sim.dynamics.inertia import at, Dynamics, inverted, kicked
from leo_sim.dynamics.tree_kernel import (
    bias_torques,
    FIGURES,
    inertia,
    KINDS,
    placed,
    room_for,
    Tree,
)
from leo_sim.kinematics.frames import turning_parts


class Spatial(Dynamics):
    """Inertia and bias of a tree with any leading axes.

    Inertial figures are floats, or arrays (S, 1) that scan S values, (W,) or (S, W) of W windows
    that differ, or (K, S, W) where they change over K sample periods; so is gravity, m/s2.
    `leading` are the axes of these, `of_states` those of one period. The world is figures
    (S, L, FIGURES) and gravity (S,), for the compiled functions.
    """

    def __init__(self, joints: Sequence[Joint], bodies: Mapping[str, Body], gravity: Any):
        self.tree = tree_of(joints)
        figures, gravity = _figures([bodies[joint.child] for joint in joints], gravity)
        self.leading = gravity.shape if gravity.size > 1 else ()
        scanned = len(self.leading) < 3 or self.leading[1:2] != (1,)
        self.of_states = self.leading[-2:] if scanned else self.leading[-1:]
        self.world = figures.reshape(-1, len(joints), FIGURES), gravity.reshape(-1)

    def kicked(
        self, q: Array, dq: Array, diagonal: Array, driving: Array, held: Array, h: Numbers
    ) -> tuple[Any, Any]:
        size, h = q.shape[-1], np.asarray(h)
        shape = common(self.axes(q, dq), *(f.shape[:-1] for f in (diagonal, driving, held, h)))
        states = rows(q, shape, size, True), rows(dq, shape, size, True)
        given = rows(diagonal, shape, size), rows(driving, shape, size), rows(held, shape, size)
        inverse, rates = np.empty((math.prod(shape), size, size)), np.empty(states[1].shape)
        steps = rows(h, shape, 1)
        kick(self.tree, *self.world, self.each(shape), *states, *given, steps, inverse, rates)
        return rates.reshape(*shape, size), inverse.reshape(*shape, size, size)

    def each(self, shape: tuple[int, ...]) -> int:
        """How many states in a row, of those with such leading axes, have the same figures."""
        inner = 0
        while inner < len(self.leading) and self.leading[-1 - inner] == 1:
            inner += 1
        return math.prod(shape[len(shape) - inner :] if self.leading else shape)

    def axes(self, q: Array, dq: Array) -> tuple[int, ...]:
        """Leading axes of what is computed for such states."""
        return common(np.shape(q)[:-1], np.shape(dq)[:-1], self.leading)

    def mass_and_bias(self, q: Array, dq: Array) -> tuple[Any, Any]:
        shape, size = self.axes(q, dq), np.shape(q)[-1]
        mass = np.empty((math.prod(shape), size, size))
        bias = self._filled(q, dq, mass)
        return mass.reshape(*shape, size, size), bias

    def bias(self, q: Array, dq: Array) -> Any:
        return self._filled(q, dq, np.empty((0, 0, 0)))

    def _filled(self, q: Array, dq: Array, mass: Array) -> Any:
        """Bias torques (..., J); fills mass, (N, J, J), if it has rows."""
        shape, size = self.axes(q, dq), np.shape(q)[-1]
        states = rows(q, shape, size, True), rows(dq, shape, size, True)
        bias = np.empty(states[0].shape)
        dynamics(self.tree, *self.world, self.each(shape), *states, mass, bias)
        return bias.reshape(*shape, size)


class Single(Dynamics):
    """The equations of motion of one joint, as `Spatial` has them.

    The rotation of a hinge is linear in the cosine and the sine of its angle, so gravity and
    external forces load it by a + b cos q + c sin q. They load a slide by a constant.
    """

    def __init__(self, joints: Sequence[Joint], bodies: Mapping[str, Body], gravity: Any):
        tree = Spatial(joints, bodies, gravity)
        ahead, aside, behind = (tree.load(np.array([a])) for a in (0.0, 0.5 * np.pi, np.pi))
        self._mass = tree.mass_and_bias(np.zeros(1), np.zeros(1))[0]
        self._mean, self._cosine = 0.5 * (ahead + behind), 0.5 * (ahead - behind)
        self._sine = aside - self._mean

    def mass_and_bias(self, q: Array, dq: Array) -> tuple[Any, Any]:
        return self._mass, -self.load(q)

    def load(self, q: Array) -> Any:
        return self._mean + self._cosine * np.cos(q) + self._sine * np.sin(q)


def tree_of(joints: Sequence[Joint]) -> Tree:
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


@compiled_without_gil
def dynamics(
    tree: Tree,
    figures: Array,
    gravity: Array,
    each: int,
    q: Array,
    dq: Array,
    mass: Array,
    bias: Array,
) -> None:
    """Fill bias (N, J) for states (N, J), and mass (N, J, J) unless it has no rows.

    Figures (S, L, FIGURES) and gravity (S,) serve `each` states in a row, one after the other and
    then from the first again.
    """
    room = room_for(tree.kind.shape[0])
    for n in range(q.shape[0]):
        s = (n // each) % figures.shape[0]
        own, down = figures[s], gravity[s]
        placed(tree, own, n, q, room)
        bias_torques(tree, own, down, n, dq, room, bias)
        if mass.shape[0] > 0:
            inertia(tree, room, mass[n])


@compiled_without_gil
def kick(
    tree: Tree,
    figures: Array,
    gravity: Array,
    each: int,
    q: Array,
    dq: Array,
    diagonal: Array,
    driving: Array,
    held: Array,
    h: Array,
    inverse: Array,
    rates: Array,
) -> None:
    """Fill the inverse of the inertia with the diagonal, (N, J, J), and rates, (N, J).

    See `dynamics` and `inertia.Dynamics`; fields are (N, J) or (1, J), h is (N, 1) or (1, 1), s.
    """
    size = q.shape[1]
    room = room_for(tree.kind.shape[0])
    bias, mean = np.empty_like(dq), np.empty_like(dq)
    for n in range(q.shape[0]):
        s = (n // each) % figures.shape[0]
        own, down, answer = figures[s], gravity[s], inverse[n]
        step = h[at(h, n), 0]
        placed(tree, own, n, q, room)
        inertia(tree, room, answer)
        for j in range(size):
            answer[j, j] += diagonal[at(diagonal, n), j]
        inverted(size, 0, answer)
        bias_torques(tree, own, down, n, dq, room, bias)
        kicked(n, answer, held, bias, dq, 0.5 * step, mean)
        bias_torques(tree, own, down, n, mean, room, bias)
        kicked(n, answer, driving, bias, dq, step, rates)
