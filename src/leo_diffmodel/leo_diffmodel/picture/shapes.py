# SPDX-License-Identifier: Apache-2.0
"""What the URDF says its links look like: boxes, cylinders and spheres as clouds of points."""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from leo_sim.description.urdf import origin

ROUND = 24
"""Points on a circle."""

PLAIN = '#3a4654'
"""Colour of a link whose material says none."""


@dataclass(frozen=True)
class Shape:
    """A convex body drawn by the outline of its points.

    Attributes:
        link: it moves with.
        points: in link axes [m], shape (N, 3).
        colour: as `#rrggbb`.
    """

    link: str
    points: np.ndarray
    colour: str


def shapes_of(urdf: str) -> list[Shape]:
    """Shapes of all links of a URDF; meshes are left out."""
    root = ElementTree.fromstring(urdf)
    named = {m.get('name', ''): colour for m in root.findall('material') if (colour := _rgb(m))}
    found = []
    for link in root.findall('link'):
        for visual in link.findall('visual'):
            points = _points(visual.find('geometry'))
            if points is not None:
                colour = _colour(visual.find('material'), named)
                found.append(Shape(link.get('name', ''), _moved(points, visual), colour))
    return found


def _points(geometry: ElementTree.Element | None) -> np.ndarray | None:
    """A cloud whose hull is the body; None for a mesh."""
    body = None if geometry is None or not len(geometry) else geometry[0]
    if body is None:
        return None
    turn = np.linspace(0, 2 * np.pi, ROUND, endpoint=False)
    circle = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    if body.tag == 'box':
        signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
        return signs * _numbers(body.get('size')) / 2
    if body.tag == 'cylinder':
        lift = np.array([0.0, 0.0, float(body.get('length', '0')) / 2])
        ring = circle * float(body.get('radius', '0'))
        return np.concatenate([ring - lift, ring + lift])
    if body.tag == 'sphere':
        rings = [np.roll(circle, shift, axis=1) for shift in range(3)]
        return np.concatenate(rings) * float(body.get('radius', '0'))
    return None


def _moved(points: np.ndarray, visual: ElementTree.Element) -> np.ndarray:
    translation, rotation = origin(visual)
    return points @ rotation.T + translation


def _colour(material: ElementTree.Element | None, named: dict[str, str]) -> str:
    if material is None:
        return PLAIN
    return _rgb(material) or named.get(material.get('name', ''), PLAIN)


def _rgb(material: ElementTree.Element) -> str:
    colour = material.find('color')
    if colour is None:
        return ''
    red, green, blue = np.clip(_numbers(colour.get('rgba'))[:3] * 255, 0, 255).round().astype(int)
    return f'#{red:02x}{green:02x}{blue:02x}'


def _numbers(text: str | None) -> np.ndarray:
    return np.array([float(part) for part in (text or '0 0 0').split()])
