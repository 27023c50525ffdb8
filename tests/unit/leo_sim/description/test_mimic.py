# SPDX-License-Identifier: Apache-2.0
"""A joint that mimics another has no coordinate of its own: whom it follows, and from where."""

import numpy as np
import pytest
from tests.robots import CLAW, SLIDES

from leo_msgs_py.errors import UserError
from leo_sim.description.joint import columns
from leo_sim.description.urdf import parse
from leo_sim.kinematics.frames import Kinematics


def joints_of(text: str):
    return {joint.name: joint for joint in parse(text, 'g.urdf')[1]}


def test_it_has_the_column_of_its_leader_through_others_that_mimic():
    joints = joints_of(CLAW)
    bound = {'left': ('', 1.0), 'right': ('left', -1.0), 'bend': ('left', -0.5), 'spin': ('', 1.0)}
    assert {n: (j.leader, j.ratio) for n, j in joints.items()} == bound
    assert [j.name for j in joints.values() if j.independent] == ['left', 'spin']
    found = dict(zip(joints, columns(list(joints.values())), strict=True))
    assert found == {'left': 0, 'right': 0, 'bend': 0, 'spin': 1}


def test_what_brakes_it_is_felt_at_its_leader():
    joints = joints_of(CLAW)
    assert joints['left'].damping == pytest.approx(0.002 + 0.5**2 * 0.004)
    assert joints['bend'].damping == 0.0


@pytest.mark.parametrize('q', [0.0, 0.7])
def test_its_link_is_where_multiplier_and_offset_put_it(q):
    """The tip of a free joint at 0.5 * -q + 0.1 lies where that of the mimicking one does."""
    free = CLAW
    for mimic in (
        '<mimic joint="right" multiplier="0.5" offset="0.1"/>',
        '<mimic joint="left" multiplier="-1"/>',
    ):
        assert mimic in free
        free = free.replace(mimic, '')
    tree = parse(free, 'free.urdf')[1]
    angles = {'left': q, 'right': -q, 'bend': 0.5 * -q + 0.1, 'spin': 0.3}
    true = Kinematics(tree).frames(np.array([angles[j.name] for j in tree]))
    frames = Kinematics(parse(CLAW, 'g.urdf')[1]).frames(np.array([q, 0.3]))
    for link, frame in true.items():
        assert np.allclose(frames[link].rotation, frame.rotation, atol=1e-12), link
        assert np.allclose(frames[link].origin, frame.origin, atol=1e-12), link


def test_the_offset_of_a_slide_moves_it_along_its_axis():
    shifted = SLIDES.replace('<mimic joint="left"/>', '<mimic joint="left" offset="0.01"/>')
    frames = Kinematics(parse(shifted, 'g.urdf')[1]).frames(np.array([0.02]))
    assert frames['r'].origin == pytest.approx((-0.03, 0.0, 0.0))


@pytest.mark.parametrize(
    ('mimic', 'said'),
    [
        ('<mimic joint="up"/>', "'right': it mimics 'up', which is no joint that moves"),
        ('<mimic joint="right"/>', "'right': it mimics itself"),
        ('<mimic/>', "'right': its <mimic> names no joint"),
        ('<mimic joint="left" multiplier="0"/>', "'right': <mimic>: multiplier 0"),
        ('<mimic joint="left" offset="nan"/>', "'right': <mimic>: .*offset nan"),
        ('<mimic joint="left" offset="far"/>', "'right': .*'far'"),
    ],
)
def test_a_mimic_of_nothing_is_one_line(mimic, said):
    with pytest.raises(UserError, match=said) as refusal:
        parse(SLIDES.replace('<mimic joint="left"/>', mimic), 'g.urdf')
    assert '\n' not in str(refusal.value)
