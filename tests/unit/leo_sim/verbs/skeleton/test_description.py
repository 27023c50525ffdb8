# SPDX-License-Identifier: Apache-2.0
"""A robot without its gripper: the link, its joint and all beyond, robot.urdf included."""

from xml.etree import ElementTree

import pytest
from tests.places import DATA
from tests.robots import CLAW, skeleton_of, SLIDES

from leo_msgs_py.cli import main
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.verbs.skeleton.folder import make_folder

ARM = DATA / 'arm3.urdf'


def test_everything_beyond_the_link_goes(tmp_path, capsys):
    arm = tmp_path / 'arm'
    assert main(['robot', 'init', str(ARM), '-o', str(arm), '--without', 'link3']) == 0
    out = capsys.readouterr().out
    robot = load_robot(arm)
    whole = make_folder(ARM, tmp_path / 'whole', 'torque').robot
    assert robot.joint_names == whole.joint_names[:1] and 'link3' in out
    gone = {link.name for link in whole.links} - {link.name for link in robot.links}
    assert {'link3', 'link4'} <= gone
    written = ElementTree.parse(arm / 'robot.urdf').getroot()
    assert not gone & {link.get('name') for link in written.findall('link')}
    assert not gone & {c.get('link') for c in written.findall('joint/child')}


def test_what_is_no_robot_of_ours_may_be_what_goes(tmp_path):
    old = 'name="right" type="prismatic"'
    text = SLIDES.replace(old, old.replace('prismatic', 'floating'))
    with pytest.raises(UserError, match='floating'):
        skeleton_of(text, tmp_path)
    robot = skeleton_of(text, tmp_path, left_out=['r']).robot
    assert robot.joint_names == ('left',) and not robot.copies


def test_dry_friction_of_what_goes_is_not_named(tmp_path):
    limit = '<limit effort="0.05" velocity="20"/>'
    text = CLAW.replace(limit, f'{limit}<dynamics friction="1"/>')
    made = skeleton_of(text, tmp_path, left_out=['tip'])
    assert not any('friction' in note for note in made.notes)
    assert made.notes[-1] == 'tip, wheel left out with bend, spin'


@pytest.mark.parametrize(
    ('links', 'said'),
    [
        (['thumbs'], "no link 'thumbs'; nearest: 'thumb'|no link 'thumbs'"),
        (['spin'], "'spin'; it is a joint, whose link is 'wheel'"),
        (['base'], "'base' is the root"),
        (['thumb'], "'right' mimics 'left', which --without takes out.*--without finger"),
        (['thumb', 'finger'], 'no joint moves'),
    ],
)
def test_what_cannot_go_is_one_line_and_nothing_written(tmp_path, links, said):
    with pytest.raises(UserError, match=said) as refusal:
        skeleton_of(CLAW, tmp_path, left_out=links)
    assert '\n' not in str(refusal.value) and not (tmp_path / 'robot').exists()
