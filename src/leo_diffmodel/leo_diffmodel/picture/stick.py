# SPDX-License-Identifier: Apache-2.0
"""A robot's stick figure and the shapes of its URDF, in the plane it moves in, pose by pose."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from leo_sim.description.robot import Robot
from leo_sim.description.urdf import origin
from leo_sim.kinematics.frames import Kinematics

TOUCHING = 0.002  # a contact this near to the ground [m] is drawn as touching
VIEWS = {1: (0, 2), 0: (1, 2), 2: (0, 1)}  # axis most hinges turn about -> the two axes one sees
TURNING = ('revolute', 'continuous')
SHORT = 1e-3  # lines this short are left out [m]
ROUND = 24  # points on a circle
PLAIN = '#3a4654'
"""Colour of a link whose material says none."""


@dataclass(frozen=True)
class Pose:
    """A robot at one time, in the plane of view [m]."""

    outlines: list[tuple[np.ndarray, str]]  # filled shapes: corners (N, 2) and colour
    sticks: list[tuple[np.ndarray, str]]  # lines, in the same way
    hinges: np.ndarray  # shape (H, 2)
    touching: np.ndarray  # which contacts touch the ground, shape (C,)
    touched: np.ndarray  # where they do, shape (N, 2)

    def points(self) -> np.ndarray:
        parts = [p for p, _ in (*self.outlines, *self.sticks)] + [self.hinges, self.touched]
        return np.concatenate([part.reshape(-1, 2) for part in parts])


class Stick:
    def __init__(self, robot: Robot):
        self.robot, walks = robot, robot.base == 'planar'
        self._tree, self._shapes = Kinematics(robot.joints), shapes_of(robot.urdf)
        self._axes = _view(robot)
        self._colours = {shape.link: shape.colour for shape in reversed(self._shapes)}
        self._lines = list(_lines(robot))
        base = robot.joint_names[:3] if walks else ()
        self._hinged = [j.child for j in robot.joints if j.kind in TURNING and j.name not in base]
        first = robot.joints[0].translation
        self.root = None if walks else np.array([first[axis] for axis in self._axes])
        """Where the first joint is bolted to the world, (2,); None for a floating robot."""
        slope = robot.constants['ground.slope'].value if robot.contacts else 0.0
        self.ground = slope if robot.contacts else None  # its slope [rad], where it can be touched
        self._up = np.array([-np.sin(slope), np.cos(slope)])

    def pose(self, q: np.ndarray) -> Pose:
        seen, contacts = self._seen(q), self.robot.contacts
        outlines = [(_hull(seen(s.link, s.points)), s.colour) for s in self._shapes]
        hinges = [seen(child, np.zeros(3))[0] for child in self._hinged]
        places = [seen(c.link, np.array([c.x, 0.0, c.z]))[0] for c in contacts]
        centres, radii = np.array(places).reshape(-1, 2), np.array([c.radius for c in contacts])
        touching = centres @ self._up - radii < TOUCHING
        touched = (centres - np.multiply.outer(radii, self._up))[touching]
        return Pose(outlines, self.sticks(q), np.array(hinges).reshape(-1, 2), touching, touched)

    def sticks(self, q: np.ndarray) -> list[tuple[np.ndarray, str]]:
        """The lines of the figure alone, (N, 2) and colour."""
        seen = self._seen(q)
        return [(seen(n, points), self._colours.get(n, PLAIN)) for n, points in self._lines]

    def lines(self, q: np.ndarray) -> list[np.ndarray]:
        """Points of each line, (N, 2), at angles of a model that may have run away to NaN."""
        return [points for points, _ in self.sticks(np.nan_to_num(q))]

    def _seen(self, q: np.ndarray) -> Callable[[str, np.ndarray], np.ndarray]:
        """From points of a link (N, 3) to the plane of view (N, 2), at joint angles q."""
        frames = self._tree.frames(q)

        def seen(link: str, points: np.ndarray) -> np.ndarray:
            rotation = np.array(frames[link].rotation, float).reshape(3, 3)
            world = np.atleast_2d(points) @ rotation.T + np.array(frames[link].origin, float)
            return np.asarray(world[:, list(self._axes)])

        return seen


def _lines(robot: Robot) -> list[tuple[str, np.ndarray]]:
    """Lines in link axes: to each joint on a link, round its contacts, or to its mass."""
    lines = []
    for link in robot.moving_links:
        ends = [np.array(j.translation) for j in robot.joints if j.parent == link]
        far = [end for end in ends if np.linalg.norm(end) > SHORT]
        lines += [(link, np.stack([np.zeros(3), end])) for end in far]
        if not ends:
            lines.append((link, _tip(robot, link)))
    return lines


def _tip(robot: Robot, link: str) -> np.ndarray:
    """What ends a limb: once round its contacts, or a line to its mass."""
    around = [(c.x, 0.0, c.z - c.radius) for c in robot.contacts if c.link == link]
    if not around:
        x, y, z = (robot.constants[f'links.{link}.com_{axis}'].value for axis in 'xyz')
        around = [(x, y, z)]
    return np.array([(0.0, 0.0, 0.0), *around, *([(0.0, 0.0, 0.0)] if around[1:] else [])])


def _view(robot: Robot) -> tuple[int, int]:
    """The plane most hinges turn in, as they stand at angle 0."""
    frames = Kinematics(robot.joints).frames(np.zeros(len(robot.joint_names)))
    total = np.zeros(3)
    for joint in robot.joints:
        if joint.kind in TURNING:
            rotation = np.array(frames[joint.child].rotation, float).reshape(3, 3)
            total += np.abs(rotation @ joint.axis)
    return VIEWS[int(np.argmax(total)) if total.any() else 1]


def _hull(points: np.ndarray) -> np.ndarray:
    try:
        return points[ConvexHull(points).vertices]
    except QhullError:
        return points


@dataclass(frozen=True)
class Shape:
    link: str
    points: np.ndarray  # in its axes [m], (N, 3)
    colour: str  # #rrggbb


def shapes_of(urdf: str) -> list[Shape]:
    """Boxes, cylinders and spheres of all links of a URDF; meshes and wrong ones are left out."""
    root = ElementTree.fromstring(urdf)
    named = {m.get('name', ''): colour for m in root.findall('material') if (colour := _rgb(m))}
    found = []
    for link in root.findall('link'):
        for visual in link.findall('visual'):
            with suppress(ValueError):
                found.append(_shape(link.get('name', ''), visual, named))
    return found


def _shape(link: str, visual: ElementTree.Element, named: Mapping[str, str]) -> Shape:
    """A visual of a link, of materials with these names; ValueError for a mesh or a wrong one."""
    (translation, rotation), material = origin(visual), visual.find('material')
    colour = PLAIN
    if material is not None:
        colour = _rgb(material) or named.get(material.get('name', ''), PLAIN)
    points = _points(visual.find('geometry/*')) @ rotation.T + translation
    if not np.isfinite(points).all():
        raise ValueError('a size is no number')
    return Shape(link, points, colour)


def _points(body: ElementTree.Element | None) -> np.ndarray:
    """A cloud whose hull is a body; ValueError for a mesh."""
    if body is None:
        raise ValueError('no geometry')
    turn = np.linspace(0, 2 * np.pi, ROUND, endpoint=False)
    circle = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    radius = float(body.get('radius', '0'))
    if body.tag == 'box':
        signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
        return signs * _numbers(body.get('size')) / 2
    if body.tag == 'cylinder':
        lift = np.array([0.0, 0.0, float(body.get('length', '0')) / 2])
        return np.concatenate([circle * radius - lift, circle * radius + lift])
    if body.tag == 'sphere':
        return np.concatenate([np.roll(circle, shift, axis=1) for shift in range(3)]) * radius
    raise ValueError(f'{body.tag} is not drawn')


def _rgb(material: ElementTree.Element) -> str:
    """The colour that a material says itself; '' where it says none, or a wrong one."""
    colour = material.find('color')
    if colour is not None:
        with suppress(ValueError):
            shares = np.clip(_numbers(colour.get('rgba'))[:3], 0, 1)
            red, green, blue = (round(255 * float(share)) for share in shares)
            return f'#{red:02x}{green:02x}{blue:02x}'
    return ''


def _numbers(text: str | None) -> np.ndarray:
    return np.array([float(part) for part in (text or '0 0 0').split()])
