# SPDX-License-Identifier: Apache-2.0
"""Whether a robot file may be in mm, g or degrees: one question, with the evidence."""

from collections.abc import Iterator, Sequence
import math

import numpy as np

from leo_sim.description.joint import Joint
from leo_sim.description.urdf import Link

TURNS = 4 * math.pi
"""Furthest stop of a hinge that is taken for radians, rad: few turn more than twice."""
PULL = 1e4
"""Largest torque of gravity that is taken for N m: that of 100 kg at 10 m."""
LONG = 10.0
"""Longest way from a joint to the next, to a centre of mass or to a stop, m: links are shorter."""
HEAVY = 100.0
"""Mass beyond which a link that gravity pulls too hard may be in grams, kg: few links weigh it."""
DENSE, LEAST = 2e4, 10.0
"""Densest link and the lightest that is asked for it, kg/m3 and kg: lead has 1.1e4, and the
inertia of light links is often made up."""


def doubt(links: Sequence[Link], joints: Sequence[Joint], loads: dict[str, float]) -> str:
    """A question that names the units and why; '' where nothing speaks against m, kg and rad.

    Args:
        links: Of the tree.
        joints: Of the tree.
        loads: Largest torque of gravity at each joint that moves, N m (N for slides).
    """
    found: dict[str, str] = {}
    hung = {joint.child for joint in joints}
    links = [link for link in links if link.name in hung]
    for unit, why in (*_lengths(links, joints), *_masses(links, joints, loads), *_angles(joints)):
        found.setdefault(unit, why)
    if not found:
        return ''
    *most, last = found
    units = f'{", ".join(most)} and {last}' if most else last
    return (
        f'is this file in {units}? {"; ".join(dict.fromkeys(found.values()))}; a robot file '
        'is in m, kg, kg m2 and rad'
    )


def _angles(joints: Sequence[Joint]) -> Iterator[tuple[str, str]]:
    for joint in joints:
        low, high = joint.limits
        if joint.kind == 'revolute' and TURNS < max(-low, high) < math.inf:
            yield 'degrees', f'{joint.name} turns from {low:g} to {high:g} rad'


def _lengths(links: Sequence[Link], joints: Sequence[Joint]) -> Iterator[tuple[str, str]]:
    for joint in joints:
        far = float(np.linalg.norm(joint.translation))
        if far > LONG:
            yield 'mm', f'{joint.name} is {far:g} m from the joint before it'
        low, high = joint.limits
        if joint.kind == 'prismatic' and LONG < max(-low, high) < math.inf:
            yield 'mm', f'{joint.name} slides from {low:g} to {high:g} m'
    for link in links:
        if (far := float(np.linalg.norm(link.body.com))) > LONG:
            yield 'mm', f'the centre of mass of {link.name} is {far:g} m from its joint'


def _masses(
    links: Sequence[Link], joints: Sequence[Joint], loads: dict[str, float]
) -> Iterator[tuple[str, str]]:
    for link in links:
        mass = float(link.body.mass)
        if mass > LEAST and mass > DENSE * _size(link) ** 3:
            yield 'g', f'{link.name} weighs {mass:g} kg and is about {_size(link):.2g} m large'
    hinges = {j.name for j in joints if j.kind != 'prismatic'}
    pulled = {name: load for name, load in loads.items() if name in hinges and load > PULL}
    if not pulled:
        return
    joint, load = max(pulled.items(), key=lambda item: item[1])
    heaviest = max(links, key=lambda link: float(link.body.mass))
    why = f'gravity pulls at {joint} with {load:.2g} N m'
    if heaviest.body.mass > HEAVY:
        yield 'g', f'{heaviest.name} weighs {heaviest.body.mass:g} kg and {why}'
    elif not any(_lengths(links, joints)):
        yield 'mm or g', why


def _size(link: Link) -> float:
    """How large a link is, m: twice its centre of mass' distance or its radius of gyration."""
    mass, com, inertia, _ = link.body
    return 2 * max(float(np.linalg.norm(com)), math.sqrt(max(*inertia[:3], 0.0) / mass))
