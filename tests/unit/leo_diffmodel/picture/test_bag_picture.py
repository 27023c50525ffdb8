# SPDX-License-Identifier: Apache-2.0
"""Pictures of bags: what is drawn where, and what is said about what cannot be drawn."""

import subprocess

import numpy as np
from PIL import Image
import pytest
from tests.commands import LEO

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.picture.bag_picture import show
from leo_diffmodel.picture.palette import TOUCH
from leo_diffmodel.picture.stick import PLAIN, shapes_of, Stick
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot, named_robots
from leo_sim.model import Model

ROBOTS = sorted(named_robots())


def bag_of(name, folder, seconds=1.0):
    """A bag in which every joint swings a little round its start, LEO's feet lifted late."""
    robot = load_robot(name)
    t = np.arange(0.0, seconds, 0.02)
    q = np.tile(Model(robot, engine='rigid').start('nominal').q, (len(t), 1))
    q[:, -1] -= 0.3 * np.sin(4 * t)
    if robot.base == 'planar':
        q[:, 1] += np.where(t > 0.5 * seconds, 0.2, -0.001)
    volts = {a.joint: {'voltage': 0 * t, 'enabled': 1 + 0 * t} for a in robot.actuators}
    return write_runs(folder, [Run(t, robot.joint_names, q, 0 * q, inputs=volts)], {'robot': name})


def share_of(picture, colour):
    pixels = np.asarray(picture.convert('RGB')).reshape(-1, 3)
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return np.mean(np.all(pixels == wanted, axis=1))


@pytest.mark.parametrize('name', ROBOTS)
def test_every_robot_is_drawn(name, tmp_path):
    bag = bag_of(name, tmp_path / 'bag')
    strip = Image.open(show(bag, tmp_path / 'strip.png'))
    single = Image.open(show(bag, tmp_path / 'single.png', at=0.2))
    assert strip.width == 1600
    assert single.width == 640
    assert min(share_of(image, '#ffffff') for image in (strip, single)) > 0.3
    assert max(share_of(image, '#ffffff') for image in (strip, single)) < 0.99


def test_a_model_that_takes_another_input_is_drawn_too(tmp_path):
    t = np.arange(0.0, 1.0, 0.02)
    driven = {'pivot': {'voltage': 1 + 0 * t}}
    q = np.sin(t)[:, None]
    bag = write_runs(tmp_path / 'bag', [Run(t, ['pivot'], q, 0 * q, inputs=driven)], {})
    assert show(bag, tmp_path / 'strip.png', 'torque_pendulum').is_file()


def test_contacts_are_drawn_where_feet_touch(tmp_path):
    bag = bag_of('leo', tmp_path / 'bag')
    on, off = (Image.open(show(bag, tmp_path / f'{at}.png', at=at)) for at in (0.2, 0.8))
    assert share_of(on, TOUCH) > 1e-4
    assert share_of(off, TOUCH) == 0


def test_the_stick_figure_is_the_robot():
    robot = load_robot('leo')
    pose = Stick(robot).pose(np.array([0.0, 0.393865, 0, 0, 0, 0, 0, 0, 0]))
    assert pose.hinges[0] == pytest.approx([0.00273, 0.27309])
    assert pose.hinges[-1] == pytest.approx([0.00678, 0.04859])
    feet = np.concatenate([line for line, _ in pose.sticks if np.allclose(line[0], line[-1])])
    assert feet[:, 1].min() == pytest.approx(0.0, abs=1e-12)
    names = [c.name for c in robot.contacts]
    touching = {name for name, touches in zip(names, pose.touching, strict=True) if touches}
    assert touching == {'left_heel', 'left_toe', 'right_heel', 'right_toe'}


def test_an_animation_runs_as_fast_as_the_robot(tmp_path):
    bag = bag_of('leo', tmp_path / 'bag')
    film = Image.open(show(bag, tmp_path / 'film.gif', at=0.2, seconds=0.6))
    assert film.n_frames == 16
    assert film.info['duration'] == 40
    assert film.size == (720, 440)


def test_a_film_without_ffmpeg_says_so(tmp_path, monkeypatch):
    bag = bag_of('pendulum', tmp_path / 'bag')
    monkeypatch.setenv('PATH', str(tmp_path))
    with pytest.raises(UserError, match=r'needs the program ffmpeg; install it or write a \.gif'):
        show(bag, tmp_path / 'film.mp4', seconds=0.2)
    assert not (tmp_path / 'film.mp4').exists()


@pytest.mark.parametrize(
    ('changes', 'said'),
    [
        ({'output': 'swing.jpg'}, 'none of .png, .gif, .mp4'),
        ({'output': 'nowhere/swing.png'}, 'nowhere is no folder'),
        ({'at': 7.0}, r'nothing was recorded at 7 s; .* between 0\.00 and 0\.98 s'),
        ({'seconds': 0.0}, '--seconds is 0'),
        ({'poses': 0}, '--poses is 0; give 1 to 40'),
        ({'model': 'leo'}, 'left_hip'),
    ],
)
def test_what_cannot_be_drawn(changes, said, tmp_path):
    bag = bag_of('pendulum', tmp_path / 'bag')
    output = tmp_path / changes.pop('output', 'swing.png')
    with pytest.raises(UserError, match=said):
        show(bag, output, **changes)
    assert not output.exists()


def test_shapes_of_a_urdf():
    every = shapes_of(load_robot('leo').urdf)
    shapes = {shape.link: shape for shape in every}
    assert shapes['torso'].points.max(axis=0) == pytest.approx([0.025, 0.05, 0.120775])
    assert shapes['left_shank'].colour == '#333842'
    assert [s.colour for s in every if s.link == 'left_foot'] == ['#0073b2', '#333842']


BALL = '<geometry><sphere radius="0.1"/></geometry>'


@pytest.mark.parametrize(
    ('visual', 'colours'),
    [
        ('<geometry><box size="1 2"/></geometry>', []),
        ('<geometry><cylinder radius="thin" length="1"/></geometry>', []),
        ('<geometry><sphere radius="nan"/></geometry>', []),
        ('<geometry><mesh filename="arm.stl"/></geometry>', []),
        (f'<origin xyz="0 0"/>{BALL}', []),
        (f'{BALL}<material name="m"><color rgba="red"/></material>', [PLAIN]),
        (f'{BALL}<material name="m"><color rgba="0.1 0.2"/></material>', [PLAIN]),
        (f'{BALL}<material name="wrong"/>', [PLAIN]),
    ],
)
def test_what_a_urdf_draws_wrongly_is_left_out(visual, colours):
    wrong = '<material name="wrong"><color rgba="1 nan 0 1"/></material>'
    urdf = f'<robot name="r">{wrong}<link name="a"><visual>{visual}</visual></link></robot>'
    assert [shape.colour for shape in shapes_of(urdf)] == colours


def test_the_command(tmp_path):
    words = [LEO, 'bag', 'show', str(bag_of('double_pendulum', tmp_path / 'swing'))]
    run = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    assert (run.returncode, run.stderr) == (0, '')
    assert run.stdout.startswith('wrote swing.png\nnext: leo ')
    assert (tmp_path / 'swing.png').is_file()
