# SPDX-License-Identifier: Apache-2.0
"""A robot as solid parts in three dimensions: the bodies and meshes that its URDF shows."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot

from .stick import lines_of, SHORT
from .visuals import ball, numbers, PLAIN, points_of, Visual, visuals_of

FORMATS = ('.stl', '.obj', '.dae')
PACKAGE = 'package://'
THICK = 0.1  # radius of a capsule, in lengths of the median line of the stick figure


@dataclass(frozen=True)
class Part:
    """Triangles in the axes of a link."""

    link: str
    points: np.ndarray  # m, (N, 3)
    faces: np.ndarray  # three points each, (M, 3)
    colour: str  # #rrggbb


def parts_of(robot: Robot) -> list[Part]:
    """What the URDF shows of each link; of a moving link without that, its lines as capsules.

    A wrong body is left out. UserError: a mesh is no file of the robot's folder, or a wrong one.
    """
    found = []
    for visual in visuals_of(robot.urdf):
        if visual.body.tag == 'mesh':
            found.append(_mesh(robot.folder, visual))
        else:
            with suppress(ValueError, QhullError):
                points = visual.placed(points_of(visual.body))
                found.append(_hull(visual.link, points, visual.colour))
    shown = {part.link for part in found}
    return found + [part for part in _capsules(robot) if part.link not in shown]


def _hull(link: str, points: np.ndarray, colour: str) -> Part:
    return Part(link, points, ConvexHull(points).simplices, colour)


def _capsules(robot: Robot) -> Iterator[Part]:
    """Each line of the stick figure as the hull of two balls."""
    pairs = [(n, *ends) for n, points in lines_of(robot) for ends in pairwise(points)]
    lines = [(n, a, b) for n, a, b in pairs if np.linalg.norm(b - a) > SHORT]
    lengths = [float(np.linalg.norm(b - a)) for _, a, b in lines]
    for name, a, b in lines:
        end = THICK * float(np.median(lengths)) * ball()
        yield _hull(name, np.concatenate([end + a, end + b]), PLAIN)


def _mesh(folder: Path, visual: Visual) -> Part:
    name = visual.body.get('filename', '')
    path, said = _inside(folder, name), f'{folder}: mesh {name!r} of link {visual.link!r}'
    if path is None:
        raise UserError(f'{said} is no file in this folder; copy it there')
    if path.suffix.lower() not in FORMATS:
        raise UserError(f'{said} is none of {", ".join(FORMATS)}; convert it')
    try:
        points, faces = _read(path)
        points = visual.placed(points * numbers(visual.body.get('scale', '1 1 1')))
    except ValueError as error:
        raise UserError(f'{said} cannot be drawn: {error}') from error
    return Part(visual.link, points, faces, visual.colour)


def _inside(folder: Path, name: str) -> Path | None:
    """The file of the robot's folder that a URDF names, by that or as of a package; else None."""
    if name.startswith(PACKAGE):
        name = name.removeprefix(PACKAGE).partition('/')[2]
    try:
        path = (folder / name).resolve()
        there = path.is_relative_to(folder.resolve()) and path.is_file()
    except (OSError, ValueError):  # a name that no file can have
        return None
    return path if there else None


def _read(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points [m] and faces of a file, without others that it names; ValueError: it has none."""
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
        raise ValueError(f'it is damaged ({error})') from error
    if not len(mesh.faces):
        raise ValueError('it has no triangles')
    return np.asarray(mesh.vertices, float), np.asarray(mesh.faces)
