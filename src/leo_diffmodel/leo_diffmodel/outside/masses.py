# SPDX-License-Identifier: Apache-2.0
"""Torques of what a robot's links may weigh besides what their model says.

The torque of a motion is linear in the mass of each link, in its first moments and in its inertia
about the joint (Atkeson, An and Hollerbach 1986). Masses at points of a link, none of them
negative, give what a payload can do, and nothing that no payload can.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from leo_diffmodel.outside.settings import OUTSIDE
from leo_sim.description.joint import Body
from leo_sim.dynamics.spatial import Spatial
from leo_sim.kinematics.frames import symmetric
from leo_sim.model import Model

Array = np.ndarray
class Masses(NamedTuple):
    """Torques (N, J, P) that a motion takes for one more of each of P, and the most of each (P,).

    First `links` times every link as the model has it, then kilograms at points of the links.
    """

    torque: Array
    most: Array
    links: int


def masses(model: Model, q: Array, dq: Array, ddq: Array) -> Masses:
    """What N instants of a motion q, dq, ddq (N, J) would take of other masses.

    What is added to a link is at its joint, at its far end, or beside: there no more than is usual,
    and nothing beyond the joint, where it would carry the weight of the link.
    """
    moving = {j.child: model.laws.bodies[j.child] for j in model.robot.joints if j.kind != 'fixed'}
    loaded = [(name, _twice(body), OUTSIDE.heavier) for name, body in moving.items()]
    for name, body in moving.items():
        beside = OUTSIDE.heavier * body.mass
        most = (np.inf, np.inf, beside, beside, beside, beside)
        loaded += [(name, _with_mass(body, p), m) for p, m in zip(_places(body), most, strict=True)]

    def needed(changed: dict[str, Body]) -> Array:
        bodies = {**model.laws.bodies, **changed}
        mass, bias = Spatial(model.robot.joints, bodies, model.laws.gravity).mass_and_bias(q, dq)
        return np.asarray((mass @ ddq[..., None])[..., 0] + bias)

    given = needed({})
    torque = np.stack([needed({name: body}) - given for name, body, _ in loaded], axis=-1)
    return Masses(torque, np.array([most for *_, most in loaded]), len(moving))


def _places(body: Body) -> Array:
    """At the joint, at the far end and beside it: four points so far away (6, 3) [m]."""
    far = np.linalg.svd(np.array([body.com], dtype=float))[2]
    far[0] *= 1.0 if far[0] @ np.array(body.com) >= 0 else -1.0
    return _reach(body) * np.array([0 * far[0], far[0], far[1], -far[1], far[2], -far[2]])


def _reach(body: Body) -> float:
    """Distance of the far end of a rod with such figures from its joint [m]."""
    turns = sum(body.inertia[:3]) / 2 / max(body.mass, 1e-9)
    return float(np.sqrt(sum(x**2 for x in body.com)) + np.sqrt(3 * max(turns, 0.0)))


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
