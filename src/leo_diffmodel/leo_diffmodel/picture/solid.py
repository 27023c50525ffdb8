# SPDX-License-Identifier: Apache-2.0
"""A robot as solid parts in three dimensions: the bodies and meshes that its URDF shows."""

from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
import re
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot

from .stick import cloud, lines_of, numbers, PLAIN, Shape, shapes_of, SHORT

FORMATS = ('.stl', '.obj', '.dae')
THICK = 0.1  # radius of a capsule, in lengths of the median line of the stick figure


def parts_of(robot: Robot) -> list[Shape]:
    """What the URDF shows of each link, with faces; the lines of a link without that as capsules.

    UserError: a mesh is no file of the robot's folder, or cannot be read.
    """
    found = shapes_of(robot.urdf, partial(_read, robot.folder))
    shown = {shape.link for shape in found}
    parts = []
    for shape in found + [c for c in _capsules(robot) if c.link not in shown]:
        with suppress(QhullError):  # of no size
            faces = ConvexHull(shape.points).simplices if shape.faces is None else shape.faces
            parts.append(replace(shape, faces=faces))
    return parts


def _capsules(robot: Robot) -> list[Shape]:
    """Each line of the stick figure as two balls, whose hull it is."""
    pairs = [(n, *ends) for n, points in lines_of(robot) for ends in pairwise(points)]
    lines = [(n, a, b) for n, a, b in pairs if np.linalg.norm(b - a) > SHORT]
    lengths = [np.linalg.norm(b - a) for _, a, b in lines]
    size = THICK * np.median(lengths) if lengths else 0.0
    ball, _ = cloud(Element('sphere', radius=str(size)))
    return [Shape(name, np.concatenate([a + ball, b + ball]), PLAIN) for name, a, b in lines]


def _read(folder: Path, body: Element | None) -> tuple[np.ndarray, np.ndarray | None]:
    """As `cloud`, but of a mesh the points [m] and faces of its file."""
    if body is None or body.tag != 'mesh':
        return cloud(body)
    points, faces = _triangles(_inside(folder, body.get('filename', '')))
    return points * numbers(body.get('scale', '1 1 1')), faces


def _inside(folder: Path, name: str) -> Path:
    """The file that a URDF names, for whose package the folder stands; UserError: not in there."""
    path = folder.joinpath(re.sub('^package://[^/]*/', '', name))
    with suppress(OSError, ValueError):  # a name that no file can have
        within = path.resolve().is_relative_to(folder.resolve())
        if within and path.is_file() and path.suffix.lower() in FORMATS:
            return path
    raise UserError(f'the mesh {name!r} is no {", ".join(FORMATS)} in {folder}; copy it there')


def _triangles(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points [m] and faces of a file, without others that it names; UserError: it has none."""
    import trimesh

    kind = path.suffix[1:].lower()
    if kind == 'dae':
        import collada  # noqa: F401 - trimesh reads it with that
    try:
        with path.open('rb') as file:
            mesh = trimesh.load_mesh(file, file_type=kind)
        if mesh.units:
            mesh.convert_units('meters')
    except Exception as error:  # of a damaged file anything
        raise UserError(f'{path} is damaged: {error}') from error
    if not (len(mesh.faces) and np.isfinite(mesh.vertices).all()):
        raise UserError(f'{path} is damaged: it has no triangles')
    return np.asarray(mesh.vertices, float), np.asarray(mesh.faces)
