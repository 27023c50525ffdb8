# SPDX-License-Identifier: Apache-2.0
"""leo next: the menu stays safe, and what it predicts is what the run then shows."""

from dataclasses import replace

import numpy as np
import pytest
from tests.robots import skeleton_of, SLIDES
from tests.simulate import DT, PENDULUM, record, steps

from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.next_run.menu import menu
from leo_diffmodel.next_run.proposal import Proposal, propose
from leo_diffmodel.next_run.questions import fit_in_turn, Question, questions
from leo_diffmodel.next_run.reach import Reach, seen
from leo_diffmodel.next_run.run_file import input_units, read_run, Run, write_run
from leo_diffmodel.next_run.safety import too_far
from leo_diffmodel.next_run.simulate import simulate
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

MODEL = Model(PENDULUM)
DEAD_BAND = place(PENDULUM, 'voltage_deadband', 'pivot', v=0.05)
TWO_LEVELS = record(PENDULUM, DEAD_BAND, inputs=1.2 * np.sign(steps(PENDULUM, 8, 3)))


def near(name: str, nats: float, why: str | None = None) -> dict:
    return {'name': name, 'where': 'pivot', 'separable_nats': nats, 'same_thing': why}


def answer(*close: dict, blind: tuple[str, ...] = ()) -> dict:
    row = {'name': 'voltage_scale', 'where': 'pivot', 'confusable_with': list(close)}
    untested = [{'name': n, 'where': 'pivot', 'why': ''} for n in blind]
    return {'effects': [row] if close else [], 'not_testable': untested}


@pytest.fixture(scope='module')
def proposal() -> Proposal:
    return propose([TWO_LEVELS], MODEL, answer(near('voltage_deadband', 0.1)), seconds=6.0)


def test_open_are_close_rivals_that_are_not_the_same_thing():
    close = [near('torque_scale', 3.0), near('voltage_deadband', 0.1), near('armature', 9.0)]
    powered = Facts(PENDULUM, ever_free=False)
    (found,) = questions(answer(*close), powered)
    labels = ('voltage_scale:pivot', 'voltage_deadband:pivot', 'torque_scale:pivot')
    assert found == Question((), labels, ((0, 1), (0, 2), (1, 2)))
    assert questions(answer(), powered) == []
    torque = Facts(load_robot('torque_pendulum'), ever_free=False)
    assert questions(answer(near('torque_scale', 0.0, 'no back-EMF')), torque) == []


def test_what_too_many_turns_choose_instead_is_a_question():
    said = answer(near('armature', 9.0))
    said['effects'][0]['inclusion_probability'] = 0.7
    said['settings'] = {'stable': 0.9}
    said['stability'] = [
        {'effects': ['voltage_scale:pivot'], 'share': 0.7},
        {'effects': ['voltage_deadband:pivot'], 'share': 0.28},
        {'effects': ['torque_scale:pivot'], 'share': 0.02},
    ]
    (found,) = questions(said, Facts(PENDULUM, ever_free=False))
    assert found.choices == ('voltage_scale:pivot', 'voltage_deadband:pivot')
    said['effects'][0]['inclusion_probability'] = 0.95
    assert questions(said, Facts(PENDULUM, ever_free=False)) == []


def test_what_is_the_same_only_while_motors_are_on_is_a_question():
    rivals = [near('back_emf_scale', 0.0, 'both brake')]
    row = {'name': 'viscous_friction', 'where': 'pivot', 'confusable_with': rivals}
    bag = record(PENDULUM, place(PENDULUM, 'viscous_friction', 'pivot', b=1e-4), seconds=8.0)
    found = propose([bag], MODEL, {'effects': [row], 'not_testable': []}, seconds=8.0)
    assert found.best is not None and not found.best.run.enabled.all()
    worth = [o.worth[0] for o in found.options if o.run.enabled.all()]
    assert worth == pytest.approx([0.0] * (len(found.options) - 1), abs=0.5)


@pytest.mark.parametrize('robot', ['pendulum', 'double_pendulum'])
def test_every_run_of_the_menu_stays_within_the_levels(robot):
    robot = load_robot(robot)
    levels = 0.5 * robot.limits
    runs = menu(robot, Reach.of_levels(levels), 12.0)
    assert len({r.name for r in runs}) == len(runs) >= 14
    for run in runs:
        assert run.inputs.shape == (round(12 / robot.control_period), len(levels))
        assert np.all(np.abs(run.inputs) <= levels + 1e-12) and np.abs(run.inputs).max() > 0
        assert not run.inputs[~run.enabled].any()
    assert any(not r.enabled.all() for r in runs)


def test_a_run_that_is_faster_than_anything_seen_is_not_safe():
    slow = seen([record(PENDULUM, inputs=np.full((500, 1), 0.2))], DT)
    fast = Run('fast', '', np.full((100, 1), 3.0), np.ones(100, bool))
    (track,) = simulate([fast], MODEL, DT)
    assert 'rad/s' in str(too_far(track, PENDULUM, slow))
    assert too_far(track, PENDULUM, replace(slow, speed=np.array([100.0]))) is None


def test_a_simulated_run_is_what_the_model_does():
    (run,) = [r for r in menu(PENDULUM, Reach.of_levels(np.ones(1)), 4.0) if not r.enabled.all()]
    (track,) = simulate([run], MODEL, DT)
    (episode,) = track.episodes
    assert track.state_period == pytest.approx(DT)
    state = MODEL.start('nominal', np.random.default_rng(0))
    for k in range(100):
        at = round(k * DT / PENDULUM.control_period - 0.5 + 1e-9)
        assert episode.inputs[k] == run.inputs[k // 5] and at <= k // 5
        np.testing.assert_allclose(episode.q[k], state.q, atol=1e-6)
        state = MODEL.step(state, run.inputs[k // 5], DT, enabled=run.enabled[k // 5 : k // 5 + 1])


def test_it_proposes_other_levels_where_two_levels_left_it_open(proposal):
    assert proposal.aim == 'separate' and proposal.hopeless == ()
    assert proposal.best is not None and proposal.best.worth[0] > 50
    nats = {o.run.name: o.worth[0] for o in proposal.options}
    assert nats['binary'] < 0.5 * proposal.best.worth[0]
    ranks = [o.worth for o in proposal.options if not o.unsafe]
    assert ranks == sorted(ranks, reverse=True)


def test_the_predicted_gain_is_what_the_run_then_gives(proposal):
    run = proposal.best.run
    new = record(PENDULUM, DEAD_BAND, inputs=np.repeat(run.inputs, 5, axis=0), seed=5)
    posed = pose([TWO_LEVELS, new], (), MODEL)
    problem = replace(posed.problem, train=np.ones_like(posed.problem.train))
    known = {c.label: c for c in candidates(MODEL)}
    posed, labels = replace(posed, problem=problem), ('voltage_deadband', 'voltage_scale')
    right, wrong = (fit_in_turn(posed, 1.0, [known[f'{label}:pivot']]) for label in labels)
    assert right.loss.sum() + 0.2 * min(proposal.best.worth[0], 1000) < wrong.loss.sum()


def test_with_nothing_open_it_shows_what_could_not_be_tested():
    still = record(PENDULUM, inputs=1e-3 * steps(PENDULUM, 8, 1))
    found = propose([still], MODEL, answer(blind=('viscous_friction', 'armature')), seconds=4.0)
    told = {*found.points, *found.hopeless}
    assert found.aim == 'show' and told == {'viscous_friction:pivot', 'armature:pivot'}
    assert propose([still], MODEL, answer(), seconds=4.0).aim == 'nothing'


GOOD = '# robot: pendulum\ntime [s],pivot [V],torque\n0,1,on\n0.2,-1,off\n0.4,0,on\n'


def test_a_run_file_by_hand_is_held_from_row_to_row(tmp_path):
    path = tmp_path / 'mine.csv'
    path.write_text(GOOD.replace('-1', '-9'))
    run = read_run(path).run_for(PENDULUM)
    assert run.inputs[:, 0].tolist() == [1.0] * 4 + [-3.0] * 4, 'within the limits'
    assert run.enabled.tolist() == [True] * 4 + [False] * 4
    with pytest.raises(UserError, match='takes pivot in N m'):
        read_run(path).run_for(load_robot('torque_pendulum'))


def test_a_run_file_replaces_only_a_run_file(tmp_path):
    run, log = Run('r', '', np.ones((9, 1)), np.ones(9, bool)), tmp_path / 'log.csv'
    for _ in range(2):
        write_run(tmp_path / 'run.csv', run, PENDULUM)
    log.write_text('time,pos\n0,1\n')
    with pytest.raises(UserError, match=r'log\.csv exists and is no run file'):
        write_run(log, run, PENDULUM)
    assert log.read_text() == 'time,pos\n0,1\n'


@pytest.mark.parametrize(
    ('kind', 'unit', 'of_turning'), [('torque', 'N', 'N m'), ('position', 'm', 'rad')]
)
def test_inputs_of_a_slide_are_in_its_unit_and_old_ones_are_read(kind, unit, of_turning, tmp_path):
    robot = skeleton_of(SLIDES, tmp_path, kind).robot
    run = Run('r', '', np.full((9, 1), 0.02), np.ones(9, bool))
    path = write_run(tmp_path / 'run.csv', run, robot)
    text = path.read_text()
    assert f'left [{unit}]' in text and input_units(robot) == unit
    for said in (unit, of_turning):
        path.write_text(text.replace(f'[{unit}]', f'[{said}]'))
        assert read_run(path).run_for(robot).inputs == pytest.approx(run.inputs)
    for said, wrong in (('V', f'has inputs left in V.*left in {unit}'), ('kg', 'no unit of')):
        path.write_text(text.replace(f'[{unit}]', f'[{said}]'))
        with pytest.raises(UserError, match=wrong):
            read_run(path).run_for(robot)


@pytest.mark.parametrize('last', ['2e8', '1e300'])
def test_a_run_of_years_is_one_line(last, tmp_path):
    path = tmp_path / 'mine.csv'
    path.write_text(GOOD.replace('0.4,', f'{last},'))
    with pytest.raises(UserError, match=r'control periods of pendulum, and may have 1e\+06'):
        read_run(path).run_for(PENDULUM)
