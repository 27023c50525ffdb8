# SPDX-License-Identifier: Apache-2.0
"""Robots on top of each other in three dimensions: what is shown where, and what is refused."""

import re
import shutil
import sys
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest
from tests.simulate import bag, record, TORQUE

from leo_diffmodel.picture.solid import parts_of
from leo_diffmodel.picture.solid_page import solid_page
from leo_diffmodel.verbs.bag import main
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.effects import place

SHOWN = '</inertial><visual><origin xyz="0.1 0 0" rpy="0 0 {}"/><geometry>{}</geometry></visual>'
BETTER = """{robot: torque_pendulum, effects: [
{name: coulomb_friction, where: pivot, parameters: {c: {value: 0.2, unit: N m}}}]}"""


def arm(folder, body):
    """A double pendulum whose upper link shows a body, turned a quarter, and the lower nothing."""
    shutil.copytree(load_robot('double_pendulum').folder, folder / 'arm')
    for path in (folder / 'arm').iterdir():
        text = re.sub('(?s)<visual>.*?</visual>', '', path.read_text().replace('upper', 'up/per'))
        path.write_text(text.replace('</inertial>', SHOWN.format(np.pi / 2, body), 1))
    return load_robot(folder / 'arm')


@pytest.fixture
def poses(monkeypatch):
    """Where the nodes are at each time, as a stand-in for viser is told."""
    nodes, seen, server = {}, [], MagicMock()
    monkeypatch.setitem(sys.modules, 'viser', MagicMock(ViserServer=lambda *_, **__: server))
    server.scene.add_frame = lambda name, **_: nodes.setdefault(name, SimpleNamespace())
    recorded = server.get_scene_serializer.return_value
    recorded.insert_sleep = lambda _: seen.append({n: {**vars(h)} for n, h in nodes.items()})
    recorded.as_html.return_value = '<body></body>'
    return seen


def test_a_mesh_is_as_large_and_where_the_urdf_says(tmp_path):
    pytest.importorskip('trimesh')
    robot = arm(tmp_path, '<mesh filename="package://arm/a.OBJ" scale="1e-3 1e-3 1e-3"/>')
    (robot.folder / 'a.OBJ').write_text('v 0 0 0\nv 1000 0 0\nv 0 2000 0\nf 1 2 3\n')
    corners = [[0.1, 0, 0], [0.1, 1, 0], [-1.9, 0, 0]]
    np.testing.assert_allclose(parts_of(robot)[0].points, corners, atol=1e-12)
    (robot.folder / 'a.OBJ').write_text('no mesh')
    with pytest.raises(UserError, match='is damaged: it has no triangles'):
        parts_of(robot)


@pytest.mark.parametrize('name', ['../a.obj', 'package://b/../a.obj', '/{}/a.obj', 'b.obj', 'c'])
def test_a_mesh_that_is_not_in_the_folder_is_refused(name, tmp_path):
    robot = arm(tmp_path, f'<mesh filename="{name.format(tmp_path)}"/>')
    (tmp_path / 'a.obj').touch()
    (robot.folder / 'b.obj').symlink_to(tmp_path / 'a.obj')
    with pytest.raises(UserError, match=r'is no \.stl, \.obj, \.dae in .*arm; copy it there'):
        parts_of(robot)


def test_parts_are_where_the_model_has_them_and_names_are_text(tmp_path, poses):
    robot, q = arm(tmp_path, '<box size="2 4 6"/>'), np.array([[[0.4, 0.9]], [[-0.5, 1.1]]])
    box, capsule = parts_of(robot)
    assert box.points.max(axis=0) == pytest.approx([2.1, 1, 3]) and len(box.faces) == 12
    assert capsule.points[:, 2].min() == pytest.approx(-0.166 - 0.1 * (0.3 + 0.166) / 2)
    page = solid_page('<b>', robot, np.arange(2.0), q, ['a'])
    assert '&lt;b&gt;' in page and '<b>' not in page and '/a/0 up per' in poses[0]
    for one, half, nodes in zip(q[:, 0, 0], q[:, 0].sum(axis=1) / 2, poses, strict=True):
        elbow, wxyz = nodes['/a/1 lower'].values()
        assert elbow == pytest.approx([0.3 * np.sin(one), 0, 0.7 - 0.3 * np.cos(one)])
        assert wxyz == pytest.approx([np.cos(half), 0, -np.sin(half), 0])


def test_the_command_shows_what_is_predicted_from_measured_states_on(tmp_path, poses):
    friction, better = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2), tmp_path / 'b.yaml'
    swing = bag(tmp_path / 'swing', record(TORQUE, friction, seconds=4))
    better.write_text(BETTER)
    words = ['show', swing, '-o', tmp_path / 'a.html', '--at', 0, '--seconds', 2]
    assert main([*map(str, words), '--model', 'torque_pendulum', '--repaired', str(better)]) == 0
    turns = [[node['wxyz'] for node in nodes.values()] for nodes in poses]
    measured, given, repaired = np.moveaxis(turns, 1, 0)
    assert given[0] == pytest.approx(measured[0]) == repaired[0] and len(turns) == 47
    assert np.abs(given - measured).max() > 3 * np.abs(repaired - measured).max()
