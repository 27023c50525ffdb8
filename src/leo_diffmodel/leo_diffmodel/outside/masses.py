# SPDX-License-Identifier: Apache-2.0
"""Torques of what a robot's links may weigh besides what their model says.

The torque of a motion is linear in the mass of each link, in its first moments and in its inertia
about the joint (Atkeson, An and Hollerbach 1986). Masses at points of a link, none of them
negative, give what a payload can do, and nothing that no payload can.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from leo_diffmodel.outside.samples import Array
from leo_diffmodel.outside.settings import OUTSIDE
from leo_sim.description.joint import Body
from leo_sim.dynamics.spatial import Spatial
from leo_sim.kinematics.frames import symmetric
from leo_sim.model import Model


@dataclass(frozen=True)
class Motion:
    """N instants of a robot's motion, and what they would take if it weighed something else."""

    model: Model
    q: Array  # angles, rates and accelerations in SI units, shape (N, J)
    dq: Array
    ddq: Array

    @cached_property
    def masses(self) -> tuple[Array, Array, Array]:
        """Torques (N, J, P) for one more of each of P, with the least and most of each (P,).

        Each link as the model has it, then 1 kg at its joint and about its far end. None is beside
        or beyond the joint: a payload changes where gravity pulls to by less than a wrong zero.
        """
        bodies = self.model.laws.bodies
        moving = [j.child for j in self.model.robot.joints if j.kind != 'fixed']
        loaded = [(name, _twice(bodies[name])) for name in moving]
        limits = [(OUTSIDE.lighter, OUTSIDE.heavier)] * len(moving)
        for name in moving:
            loaded += [(name, _with_mass(bodies[name], place)) for place in _places(bodies[name])]
            limits += [(0.0, np.inf)] * 6
        given = self._needed(bodies)
        torque = [self._needed({**bodies, name: body}) - given for name, body in loaded]
        return np.stack(torque, axis=-1), *np.array(limits).T

    @cached_property
    def turned(self) -> Array:
        """What the motion takes more if one joint is turned on [N m/rad], shape (N, J, J)."""
        bodies, step = self.model.laws.bodies, OUTSIDE.turn
        there = [replace(self, q=self.q + step * one) for one in np.eye(self.q.shape[1])]
        turned = np.stack([motion._needed(bodies) for motion in there], axis=-1)
        return (turned - self._needed(bodies)[..., None]) / step

    def _needed(self, bodies: Mapping[str, Body]) -> Array:
        tree = Spatial(self.model.robot.joints, bodies, self.model.laws.gravity)
        mass, bias = tree.mass_and_bias(self.q, self.dq)
        return np.asarray((mass @ self.ddq[..., None])[..., 0] + bias)


def _places(body: Body) -> Array:
    """At the joint, at the far end and in four directions about it (6, 3) [m]."""
    far = np.linalg.svd(np.array([body.com], dtype=float))[2]
    far[0] *= 1.0 if far[0] @ np.array(body.com) >= 0 else -1.0
    c, s = np.cos(OUTSIDE.beside), np.sin(OUTSIDE.beside)
    about = [c * far[0] + sign * s * side for side in far[1:] for sign in (1, -1)]
    turns = sum(body.inertia[:3]) / 2 / max(body.mass, 1e-9)  # of a rod with such figures
    reach = float(np.sqrt(sum(x**2 for x in body.com)) + np.sqrt(3 * max(turns, 0.0)))
    return reach * np.array([0 * far[0], far[0], *about])


def _twice(body: Body) -> Body:
    return body._replace(mass=2 * body.mass, inertia=tuple(2 * x for x in body.inertia))


def _with_mass(body: Body, place: Array) -> Body:
    """A link with 1 kg more at a place in its frame."""
    mass = body.mass + 1.0
    com = (body.mass * np.array(body.com) + place) / mass
    inertia = np.array(symmetric(body.inertia)).reshape(3, 3)
    for m, at in ((body.mass, np.array(body.com)), (1.0, place)):
        off = at - com
        inertia = inertia + m * (off @ off * np.eye(3) - np.outer(off, off))
    xx, xy, xz, _, yy, yz, _, _, zz = inertia.ravel()
    return body._replace(mass=mass, com=tuple(com), inertia=(xx, yy, zz, xy, xz, yz))
