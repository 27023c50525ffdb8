# SPDX-License-Identifier: Apache-2.0
"""Robots that move on top of each other in three dimensions: one HTML file, with its viewer."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, redirect_stdout
import io
from typing import Any

from markupsafe import Markup
import numpy as np
from PIL.ImageColor import getrgb
from scipy.spatial.transform import Rotation

from leo_sim.description.robot import Robot
from leo_sim.kinematics.frames import Frame, Kinematics

from .palette import GIVEN, INK, REPAIRED
from .solid import parts_of
from .stick import Shape

COLOURS = '', GIVEN.colour, REPAIRED.colour
"""Of the robots one after the other; '' is opaque, each part in its own."""
GLASS = 0.45  # opacity of the others
LAST = 0.5  # how long the last pose stays [s]
FROM = np.array([0.7, -1.6, 0.8])  # to the camera, in sizes of the robot
Node = tuple[Any, np.ndarray, np.ndarray]
"""A link in the viewer, its places [m], (F, 3), and quaternions, (F, 4)."""
LEGEND = Markup(
    '<div style="position:fixed;left:1em;top:1em;pointer-events:none;font:14px sans-serif">'
    '{title}{lines}</div></body>'
)
LINE = Markup('<div style="color:{colour}">&#9632; {label}</div>')


def solid_page(
    title: str, robot: Robot, times: np.ndarray, poses: np.ndarray, labels: Sequence[str]
) -> str:
    """An HTML file that plays poses at `times` [s], (F,), and needs neither server nor network.

    They are joint angles of up to three robots, (F, N, J). UserError: a mesh cannot be shown.
    """
    import viser

    parts, tree = parts_of(robot), Kinematics(robot.joints)
    coloured = list(zip(labels, COLOURS, strict=False))
    with redirect_stdout(io.StringIO()), ExitStack() as ending:
        server = viser.ViserServer('127.0.0.1', 0, verbose=False)  # records; on a free port
        ending.callback(server.stop)
        _set_out(server, parts, tree.frames(poses[0, 0]))
        nodes: list[Node] = []
        for (label, colour), q in zip(coloured, np.moveaxis(poses, 1, 0), strict=True):
            nodes += _nodes(server.scene, label, colour, parts, tree, q)
        recorded = server.get_scene_serializer()
        for k, wait in enumerate(np.diff(times, append=times[-1] + LAST)):
            for handle, places, turns in nodes:
                handle.position, handle.wxyz = places[k], turns[k]
            recorded.insert_sleep(float(wait))
        page, _, end = recorded.as_html().rpartition('</body>')
    lines = [LINE.format(colour=colour or INK, label=label) for label, colour in coloured]
    return f'{page}{LEGEND.format(title=title, lines=Markup().join(lines))}{end}'


def _nodes(
    scene: Any, label: str, colour: str, parts: Sequence[Shape], tree: Kinematics, q: np.ndarray
) -> Iterator[Node]:
    """A node of each link, with its parts below it."""
    frames, count = tree.frames(q), len(q)
    look = {'opacity': GLASS if colour else None, 'flat_shading': True, 'side': 'double'}
    for number, link in enumerate(dict.fromkeys(part.link for part in parts)):
        name = f'/{label}/{number} {link.replace("/", " ")}'  # a slash would begin a node below
        handle = scene.add_frame(name, show_axes=False)
        for k, p in enumerate(part for part in parts if part.link == link):
            rgb = getrgb(colour or p.colour)
            scene.add_mesh_simple(f'{name}/{k}', p.points, p.faces, color=rgb, **look)
        turns = Rotation.from_matrix(np.broadcast_to(frames[link].rotation, (count, 3, 3)))
        places = np.broadcast_to(frames[link].origin, (count, 3))
        yield handle, places, turns.as_quat()[:, [3, 0, 1, 2]]


def _set_out(server: Any, parts: Sequence[Shape], frames: Mapping[str, Frame]) -> None:
    """A level grid below the robot and its mount, and where one looks from."""
    points = np.vstack([np.zeros(3), *(frames[p.link].point(p.points) for p in parts)])
    low, high = points.min(axis=0), points.max(axis=0)
    below = 0.0, 0.0, low[2]
    server.scene.add_grid('/grid', infinite_grid=True, cell_size=0.1, position=below)
    middle = (low + high) / 2
    server.initial_camera.look_at = middle
    server.initial_camera.position = middle + np.linalg.norm(high - low) * FROM
