# SPDX-License-Identifier: Apache-2.0
"""Robots that move on top of each other in three dimensions: one HTML file, with its viewer."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
import io
from typing import Any

from markupsafe import Markup
import numpy as np
from PIL.ImageColor import getrgb
from scipy.spatial.transform import Rotation

from leo_sim.description.robot import Robot
from leo_sim.kinematics.frames import Frame, Kinematics

from .palette import INK, PAPER
from .solid import Part, parts_of
from .stick import Stick

GLASS = 0.45  # opacity of a robot in a colour of its own
LAST = 0.5  # how long the last pose stays [s]
FROM = np.array([0.5, -1.2, 0.6])  # to the camera, in sizes of what it looks at
LOOKS = 20  # poses that this size is read from
CELL = 0.1  # of the grid on the ground [m]
LEGEND = Markup(
    '<div style="position:fixed;left:1em;top:1em;z-index:9;pointer-events:none;'
    'font:14px/1.5 sans-serif;color:{ink};background:{paper}b0">{lines}</div></body>'
)
LINE = Markup('<div><span style="color:{colour}">&#9632;</span> {text}</div>')


@dataclass(frozen=True)
class Moving:
    label: str
    q: np.ndarray  # joint angles at each time [rad, m], (F, J)
    colour: str = ''  # translucent and all of it in that; '' is opaque, each part in its own


def solid_page(title: str, robot: Robot, times: np.ndarray, moving: Sequence[Moving]) -> str:
    """An HTML file that plays poses at `times` [s], (F,), and needs neither server nor network.

    UserError: a mesh of the robot cannot be shown.
    """
    parts, tree = parts_of(robot), Kinematics(robot.joints)
    with _server() as server:
        nodes = [node for m in moving for node in _nodes(server.scene, parts, m, tree.frames(m.q))]
        _set_out(server, robot, *_box(parts, tree, moving[0].q))
        recorded = server.get_scene_serializer()
        for k, wait in enumerate(np.diff(times, append=times[-1] + LAST)):
            for handle, places, turns in nodes:
                handle.position, handle.wxyz = places[k], turns[k]
            recorded.insert_sleep(float(wait))
        page: str = recorded.as_html()
    body, _, end = page.rpartition('</body>')
    return body + _legend(title, moving) + end


@contextmanager
def _server() -> Iterator[Any]:
    """Viser's own, which records without being asked for anything; it says so where nobody reads.

    It listens on a free port of 127.0.0.1 as long as that takes.
    """
    import viser

    with redirect_stdout(io.StringIO()):
        server = viser.ViserServer('127.0.0.1', 0, verbose=False)
        try:
            yield server
        finally:
            server.stop()


def _nodes(
    scene: Any, parts: Sequence[Part], moving: Moving, frames: dict[str, Frame]
) -> Iterator[tuple[Any, np.ndarray, np.ndarray]]:
    """For each link a node with its parts, its places [m], (F, 3), and quaternions, (F, 4)."""
    count = len(moving.q)
    for number, link in enumerate(dict.fromkeys(part.link for part in parts)):
        # a slash would begin a node below
        name = f'/{moving.label}/{number} {link.replace("/", "_")}'
        handle = scene.add_frame(name, show_axes=False)
        for k, part in enumerate(p for p in parts if p.link == link):
            look = {'color': getrgb(moving.colour or part.colour), 'flat_shading': True}
            look['opacity'] = GLASS if moving.colour else None
            look['side'] = 'double'  # files have triangles either way round
            scene.add_mesh_simple(f'{name}/{k}', part.points, part.faces, **look)
        rotation = np.broadcast_to(frames[link].rotation, (count, 3, 3))
        places = np.broadcast_to(frames[link].origin, (count, 3))
        yield handle, places, Rotation.from_matrix(rotation).as_quat()[:, [3, 0, 1, 2]]


def _box(parts: Sequence[Part], tree: Kinematics, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The lowest and the highest corner of where a robot is at angles (F, J), each (3,) m."""
    some = q[np.linspace(0, len(q) - 1, LOOKS).astype(int)]
    frames = tree.frames(some[:, None])
    ends = [frames[p.link].point(p.points).reshape(-1, 3) for p in parts]
    points = np.concatenate(ends)
    return points.min(axis=0), points.max(axis=0)


def _set_out(server: Any, robot: Robot, low: np.ndarray, high: np.ndarray) -> None:
    """The ground, below a robot that touches none, and where one looks from."""
    middle, size = 0.5 * (low + high), float(np.linalg.norm(high - low))
    slope = Stick(robot).ground
    turn, height = (0.0, low[2]) if slope is None else (slope, 0.0)
    ground = {'position': (0.0, 0.0, height), 'cell_size': CELL, 'section_size': 10 * CELL}
    wxyz = np.cos(turn / 2), 0.0, -np.sin(turn / 2), 0.0
    server.scene.add_grid('/ground', 4 * size, 4 * size, wxyz=wxyz, **ground)
    server.initial_camera.look_at = middle
    server.initial_camera.position = middle + size * FROM


def _legend(title: str, moving: Sequence[Moving]) -> Markup:
    rows = [LINE.format(colour=m.colour or INK, text=m.label) for m in moving]
    return LEGEND.format(ink=INK, paper=PAPER, lines=Markup().join([title, *rows]))
