# SPDX-License-Identifier: Apache-2.0
"""leo next on a walker: what it can do, and what that would tell."""

import numpy as np
import pytest
from tests.walker import LEO, SIGMA

from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.next_run.menu import MotionRun, walker_menu
from leo_diffmodel.next_run.proposal import Proposal
from leo_diffmodel.next_run.reach import Reach, Seen
from leo_diffmodel.next_run.run_file import read_run, write_run
from leo_diffmodel.next_run.safety import tamed
from leo_diffmodel.next_run.separate import separable
from leo_diffmodel.next_run.simulate import performed, simulate
from leo_msgs_py.errors import UserError
from leo_sim.effects import place
from leo_sim.model import Model

MODEL = Model(LEO, engine='rigid', scheme='search')
MENU = walker_menu(LEO, Reach.of_levels(0.4 * LEO.limits), 3.0)
PERIOD = 0.01


def named(text: str):
    return next(run for run in MENU if text in run.name)


def test_nothing_on_the_menu_leaves_the_robot_to_fall_over():
    assert len({run.name for run in MENU}) == len(MENU)
    for run in MENU:
        assert isinstance(run, MotionRun) or LEO.start_poses[run.start].held
    assert {'swinging', 'standing', 'stepping'} <= {r.motion for r in MENU if hasattr(r, 'motion')}
    assert named('stepping').command == 'play stepping --seed 11 --seconds 3'


def test_runs_are_simulated_as_they_will_be_recorded():
    hung, step = simulate([named('hanging: sines, small'), named('stepping')], MODEL, PERIOD)
    (episode,) = hung.episodes
    assert hung.held and not np.ptp(episode.q[:, :3], axis=0).any()
    assert np.ptp(episode.q[:, 3:], axis=0).min() > 0.01
    assert not step.held and len(step.episodes) > 1
    assert all(np.all(np.diff(e.t) > 0) for e in step.episodes)


def test_time_goes_on_while_the_robot_is_put_up_again(monkeypatch):
    begun, start = [], Model.start

    def noted(self, pose, rng, elapsed=0.0):
        begun.append(elapsed)
        return start(self, pose, rng, elapsed)

    monkeypatch.setattr(Model, 'start', noted)
    episodes = performed(named('stepping'), MODEL, PERIOD)
    assert len(episodes) > 1
    assert begun[: len(episodes)] == pytest.approx([e.t[0] for e in episodes])


def test_a_run_begins_in_its_pose_and_only_a_robot_with_that_pose_takes_it(tmp_path):
    path = write_run(tmp_path / 'run.csv', named('hanging: pulses'), LEO)
    assert read_run(path).run_for(LEO).start == 'hanging'
    path.write_text(path.read_text().replace('# start: hanging', '# start: hangig'))
    with pytest.raises(UserError, match='did you mean hanging'):
        read_run(path).run_for(LEO)


def test_evidence_against_a_wrong_model_only_and_no_window_says_too_much():
    runs = [named('swinging'), named('standing')]
    stiff = MODEL.changed(effects=[place(LEO, 'viscous_friction', 'left_hip', b=0.05)])
    nothing = Fit(Hypothesis(), np.zeros(0), np.zeros((0, 0)), *np.zeros((5, 0)))
    tracks = (simulate(runs, model, PERIOD) for model in (MODEL, stiff))
    same, other = (separable(MODEL, t, PERIOD, SIGMA, nothing) for t in tracks)
    assert np.all(same < 1.0) and np.all(other > 10.0) and np.all(other < 6.0 * 60)


def test_a_motion_is_safe_where_an_open_loop_run_is_not():
    still = Seen(-LEO.limits, LEO.limits, np.full(9, 1e-3), np.zeros(9), np.zeros(9), PERIOD)
    runs = [named('hanging: sines, small'), named('swinging')]
    (mild, motion), (hung, swung) = tamed(runs, [MODEL], still)
    assert 'rad/s' in str(hung) and mild.name == 'hanging: sines, small, gentle'
    assert swung is None and motion is runs[1]
    assert Proposal('show', (), ('a',), (), 'leo').best is None
