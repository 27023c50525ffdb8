# SPDX-License-Identifier: Apache-2.0
"""The moving stick figures of a report."""

import numpy as np
import pytest

from leo_diffmodel.report import page
from leo_diffmodel.report.sections import moving
from leo_diffmodel.report.worst import Stretch
from leo_sim.description.robot import load_robot


def stretch(robot, models: int) -> Stretch:
    """A window of 21 samples in which each further figure is 0.1 rad on at every joint."""
    time, joints = np.linspace(3.0, 4.0, 21), len(robot.joint_names)
    q = np.zeros((21, joints))
    q[:, -1] = 0.2 * np.sin(6 * time)
    motion = np.stack([q + 0.1 * i for i in range(1 + models)])
    return Stretch(0, 0, time, q[:, 0], motion[1:, :, 0], np.zeros(21), motion)


@pytest.mark.parametrize(
    'models, names', [(1, ['measured', 'the model']), (2, ['measured', 'as given', 'repaired'])]
)
@pytest.mark.parametrize('name', ['double_pendulum', 'leo'])
def test_every_model_is_a_figure_that_moves(name, models, names):
    found = moving.section(stretch(load_robot(name), models), load_robot(name), 'bag 3 s')
    film = found.values['film']
    assert [entry for entry, _ in found.values['legend']] == names
    assert film['times'][0] == 0.0 and film['times'][-1] == 1.0
    frames = film['films']
    assert len(frames) == 1 + models and all(len(f) == 21 for f in frames)
    assert frames[0][0] != frames[0][10] and frames[0][0] != frames[1][0]
    assert (found.values['ground'] is None) == (name == 'double_pendulum')


def test_a_model_that_runs_away_stays_in_finite_numbers():
    robot = load_robot('leo')
    far = stretch(robot, 1)
    far.motion[1, 5:] = 1e12
    far.motion[1, 9] = np.nan
    (_, run) = moving.section(far, robot, 'far').values['film']['films']
    assert not any('nan' in frame or 'inf' in frame for frame in run)


def test_the_page_escapes_the_title_and_needs_no_network(tmp_path):
    robot = load_robot('double_pendulum')
    html = page.render('t', 's', [moving.section(stretch(robot, 2), robot, '<b>bag</b>')])
    assert '&lt;b&gt;bag' in html and '<b>bag' not in html and 'http' not in html
