# SPDX-License-Identifier: Apache-2.0
"""What the links of a URDF look like: their bodies, where they lie, their colours."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from xml.etree.ElementTree import Element, fromstring

import numpy as np

from leo_sim.description.urdf import origin

ROUND = 24  # points on a circle
PLAIN = '#3a4654'
"""Colour of a link whose material says none."""


@dataclass(frozen=True)
class Visual:
    link: str
    body: Element  # <box>, <cylinder>, <sphere> or <mesh>
    translation: np.ndarray  # of the body in the axes of the link [m], (3,)
    rotation: np.ndarray  # (3, 3)
    colour: str  # #rrggbb

    def placed(self, points: np.ndarray) -> np.ndarray:
        """Points of the body (N, 3) in the axes of the link [m]; ValueError: no numbers."""
        points = points @ self.rotation.T + self.translation
        if not np.isfinite(points).all():
            raise ValueError('a size is no number')
        return points


def visuals_of(urdf: str) -> Iterator[Visual]:
    """All that links of a URDF show; what has no body or no sensible place is left out."""
    root = fromstring(urdf)
    named = {m.get('name', ''): colour for m in root.findall('material') if (colour := _rgb(m))}
    for link in root.findall('link'):
        for visual in link.findall('visual'):
            with suppress(ValueError):
                yield _visual(link.get('name', ''), visual, named)


def _visual(link: str, visual: Element, named: Mapping[str, str]) -> Visual:
    """A visual of a link, of materials with these names; ValueError for a wrong one."""
    (translation, rotation), body = origin(visual), visual.find('geometry/*')
    if body is None:
        raise ValueError('no geometry')
    material, colour = visual.find('material'), PLAIN
    if material is not None:
        colour = _rgb(material) or named.get(material.get('name', ''), PLAIN)
    return Visual(link, body, np.array(translation), rotation, colour)


def points_of(body: Element) -> np.ndarray:
    """A cloud (N, 3) whose hull is a body [m]; ValueError for a mesh."""
    radius = float(body.get('radius', '0'))
    if body.tag == 'box':
        signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
        return signs * numbers(body.get('size')) / 2
    if body.tag == 'cylinder':
        lift = np.array([0.0, 0.0, float(body.get('length', '0')) / 2])
        return np.concatenate([_circle() * radius - lift, _circle() * radius + lift])
    if body.tag == 'sphere':
        return ball() * radius
    raise ValueError(f'{body.tag} is not drawn')


def ball() -> np.ndarray:
    """Points on a sphere of 1 m, (N, 3)."""
    rise = np.linspace(-np.pi / 2, np.pi / 2, ROUND // 2 + 1)[:, None, None]
    points = _circle() * np.cos(rise) + np.array([0.0, 0.0, 1.0]) * np.sin(rise)
    return points.reshape(-1, 3)


def numbers(text: str | None) -> np.ndarray:
    return np.array([float(part) for part in (text or '0 0 0').split()])


def _circle() -> np.ndarray:
    turn = np.linspace(0, 2 * np.pi, ROUND, endpoint=False)
    return np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)


def _rgb(material: Element) -> str:
    """The colour that a material says itself; '' where it says none, or a wrong one."""
    colour = material.find('color')
    if colour is not None:
        with suppress(ValueError):
            shares = np.clip(numbers(colour.get('rgba'))[:3], 0, 1)
            red, green, blue = (round(255 * float(share)) for share in shares)
            return f'#{red:02x}{green:02x}{blue:02x}'
    return ''
