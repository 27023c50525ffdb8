# SPDX-License-Identifier: Apache-2.0
"""Each trap of logs made for something else is found in data that have it, and in no others."""

from dataclasses import replace

import numpy as np
import pytest
from tests.lerobot_data import write_lerobot
from tests.robots import FLYWHEEL
from tests.simulate import of_robot, PENDULUM, POSITION

from leo_diffmodel.bags.importing.column_map import ColumnMap
from leo_diffmodel.bags.importing.convert import import_logs
from leo_diffmodel.bags.recording import Episode, read_bag, Recording
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.check.angles import angle_units, positions_only
from leo_diffmodel.check.check import Bag, look_at, traps
from leo_diffmodel.check.goals import asked, frame_shift
from leo_diffmodel.check.timing import even_stamps, is_even, slow
from leo_diffmodel.outside.finding import Finding
from leo_sim.model import Model

STOPS = {'pivot': (-1.9, 1.9)}
HINGES = tuple(replace(j, limits=STOPS.get(j.name, j.limits)) for j in PENDULUM.joints)
LIMITED = replace(PENDULUM, joints=HINGES)
IMPORTED = {'imported_from': 'log'}
TICK = 2 * np.pi / 4096
FINE = 0.001


def recorded(q, goal, t, rates: str = 'absent', **metadata: str) -> Recording:
    """One joint's angles and goals (T,), as an imported bag reads."""
    dq, on = np.gradient(q, t)[:, None], np.ones((len(t), 1), dtype=bool)
    episode, period = Episode(t, q[:, None], dq, goal[:, None], on), float(np.median(np.diff(t)))
    return of_robot(POSITION, episode, period=period, metadata=IMPORTED | metadata, rates=rates)


def teleoperated(rate=30.0, late=0.0, stop=np.inf, seed=0) -> Recording:
    """40 s of a servo that follows a hand: positions read, then the goal sent `late` after [s].

    It accepts goals up to `stop` [rad] either way.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(0, 40, FINE)
    places = rng.uniform(-1, 1, 41)  # reached by starts and stops
    part = np.clip(1.6 * (time % 1.0), 0, 1)
    begin, end = places[time.astype(int)], places[time.astype(int) + 1]
    hand = begin + (end - begin) * part**3 * (10 - 15 * part + 6 * part**2)
    hand += 0.003 * np.sin(2 * np.pi * 9 * time + np.cumsum(rng.normal(0, 0.03, len(time))))
    per_frame = round(1 / rate / FINE)
    frames = np.arange(0, len(time) - per_frame, per_frame)
    goal = TICK * np.round(hand[frames] / TICK)
    acting = np.clip(np.repeat(goal, per_frame), -stop, stop)
    acting = np.r_[np.full(round(late / FINE), acting[0]), acting]
    q, dq, out = acting[0], 0.0, []
    for target in acting[: frames[-1] + 1]:
        out.append(q)
        dq += FINE * (900.0 * (target - q) - 50.0 * dq)
        q += FINE * dq
    return recorded(TICK * np.round(np.array(out)[frames] / TICK), goal, frames * FINE)


def stamped(t: np.ndarray, **metadata: str) -> Recording:
    return recorded(np.sin(t), np.sin(t), t, 'measured', **metadata)


def only(found: list[Finding]) -> Finding:
    (finding,) = found
    assert '\n' not in finding.what
    return finding


FRAMES = np.arange(900)
JITTER = np.random.default_rng(0).normal(0, 4e-4, 900)


@pytest.mark.parametrize(
    't',
    [
        FRAMES / 30,
        (FRAMES / 30).astype(np.float32).astype(float),
        (FRAMES / 30).round(3),
        (FRAMES / 50).round(2),
        np.delete(FRAMES, [40, 41, 300]) / 30,
    ],
)
def test_computed_stamps_are_even(t):
    found = only(even_stamps(stamped(t)))
    assert found.severity == 'warning' and 'stamps are frame / ' in found.what
    assert even_stamps(replace(stamped(t), metadata={})) == []
    assert only(even_stamps(stamped(FRAMES / 1000))).severity == 'ok', 'a fast loop'


@pytest.mark.parametrize(
    't',
    [
        FRAMES / 30 + JITTER,
        (FRAMES / 30 + JITTER).round(3),
        np.cumsum(1 / 30 + np.abs(JITTER)),
        FRAMES / 30 + JITTER / 10,
        (FRAMES / 20 + 20 * JITTER).round(2),
    ],
)
def test_stamps_of_a_clock_are_not(t):
    assert not is_even(t - t[0]) and even_stamps(stamped(t)) == []


@pytest.mark.parametrize(('rate', 'said'), [(30, True), (44, True), (50, False), (100, False)])
def test_a_rate_of_cameras_is_slow(rate, said):
    found = slow(stamped(FRAMES / rate))
    assert bool(found) == said
    assert not said or (found[0].severity == 'warning' and f'({rate:.3g} Hz)' in found[0].what)


@pytest.mark.parametrize('angles', [60 * np.sin(FRAMES / 30), 150 * np.sin(FRAMES / 30)])
@pytest.mark.parametrize('robot', [LIMITED, PENDULUM], ids=['limits', 'none'])
def test_angles_that_are_no_radians(angles, robot):
    angles = angles if robot is LIMITED else 3 * angles  # degrees of a joint that turns round
    found = only(angle_units(recorded(angles, angles, FRAMES / 30), robot))
    per_cent = np.abs(angles).max() < 100
    assert found.severity == 'error' and ('per cent' in found.what) == per_cent


@pytest.mark.parametrize('robot', [LIMITED, PENDULUM], ids=['limits', 'none'])
def test_radians_are_radians(robot):
    t = FRAMES / 100
    assert angle_units(recorded(1.9 * np.sin(9 * t), t, t), robot) == []
    turning = recorded(30 * t, t, t)  # a motor that runs
    assert (angle_units(turning, robot) == []) == (robot is PENDULUM)
    assert angle_units(replace(recorded(99 * np.sin(t), t, t), metadata={}), robot) == []
    said = recorded(60 * np.sin(t), t, t, angle_units_said='pivot')
    assert [f.severity for f in angle_units(said, LIMITED)] == ['error'], 'limits contradict it'


def test_a_wheel_turns_as_often_and_as_fast_as_its_log_and_its_motor_say():
    def turned(q: np.ndarray, **metadata: str) -> Recording:
        return replace(recorded(q, t, t, **metadata), joints=('shaft',), actuators=('shaft',))

    t = FRAMES / 100
    wheel = FLYWHEEL  # 300 rad/s without load
    assert angle_units(turned(134 * t), wheel) == []
    found = only(angle_units(turned(400 * t), wheel))
    assert found.severity == 'error' and 'unit: rad' in found.todo
    assert angle_units(turned(400 * t, angle_units_said='shaft'), wheel) == []


def test_differences_of_a_coarse_encoder_are_told():
    t = FRAMES / 100
    q = np.sin(t)
    coarse = recorded(2 * TICK * np.round(q / (2 * TICK)), q, t)
    found = only(positions_only(coarse, PENDULUM))
    assert found.severity == 'warning' and 'coarse to 0.063 rad/s at pivot, 9 %' in found.what
    fine = recorded(1e-6 * np.round(q / 1e-6), q, t)
    assert only(positions_only(fine, PENDULUM)).severity == 'ok'
    assert 'were made anew' in only(positions_only(replace(coarse, rates='made'), PENDULUM)).what
    assert positions_only(replace(coarse, rates='measured'), PENDULUM) == []


@pytest.mark.parametrize('seed', range(6))
def test_goals_that_were_clipped_show(seed):
    free = teleoperated(seed=seed)
    assert asked(free) == []
    reach = float(np.abs(free.episodes[0].q).max())
    found = asked(teleoperated(seed=seed, stop=0.6 * reach))
    assert only(found).severity == 'warning' and 'goes on beyond' in found[0].what
    begin, end = found[0].where[0]
    assert 0.2 <= end - begin < 10


def test_inputs_named_as_asked_are_said_to_be_so():
    log = teleoperated()
    named = replace(log, metadata=IMPORTED | {'inputs_from': 'action.a.pos, action.b.pos'})
    found = only(asked(named))
    assert found.severity == 'ok' and 'what was asked for (action.a.pos and 1 more)' in found.what
    assert asked(replace(log, metadata=IMPORTED | {'inputs_from': 'duty * supply'})) == []


def shifted(log: Recording, rows: int) -> Recording:
    """The log with each goal written `rows` rows later."""
    (episode,) = log.episodes
    moved = replace(episode, inputs=np.roll(episode.inputs, rows, axis=0))
    return replace(log, episodes=(moved,))


@pytest.mark.parametrize('rate', [30, 50])
@pytest.mark.parametrize('seed', range(3))
def test_the_frame_in_which_a_goal_acts(rate, seed):
    log = teleoperated(rate=rate, seed=seed)
    read_first = only(frame_shift(log))
    assert read_first.severity == 'ok' and 'read before the goal of their row' in read_first.what
    stepped = only(frame_shift(shifted(log, 1)))
    assert stepped.severity == 'warning' and 'hold: previous' in stepped.todo
    late = only(frame_shift(shifted(log, -1)))
    assert late.severity == 'ok' and f'acts a frame ({1e3 / rate:.0f} ms) after' in late.what


@pytest.mark.parametrize('rate', [30, 50])
@pytest.mark.parametrize('seed', range(4))
def test_a_servo_that_clips_may_hide_the_frame_but_never_says_another(rate, seed):
    log = teleoperated(rate=rate, seed=seed, stop=0.7)
    for rows, said in ((0, 'positions are read before'), (1, 'has acted'), (-1, 'acts a frame')):
        what = only(frame_shift(shifted(log, rows))).what
        assert said in what or (rows != 1 and 'does not show here' in what)


def test_half_a_frame_of_delay_is_no_shift():
    found = only(frame_shift(teleoperated(late=0.01)))
    assert found.severity == 'ok' and 'read before the goal' in found.what


def test_goals_that_stand_and_other_inputs_say_nothing():
    t = FRAMES / 30
    still = recorded(np.zeros(900), np.zeros(900), t)
    assert frame_shift(still) == [] and asked(still) == []
    assert frame_shift(replace(teleoperated(), input='voltage')) == []
    few = recorded(np.zeros(3), np.zeros(3), t[:3])
    assert frame_shift(few) == [] and even_stamps(few) == []


def test_a_lerobot_data_set_has_them_all(tmp_path):
    log = teleoperated().episodes[0]
    degrees = [np.degrees(np.repeat(x, 2, axis=1)) for x in (log.q, log.inputs)]
    data = write_lerobot(tmp_path / 'data', [tuple(degrees)])
    names = 'observation.state.shoulder_pan.pos', 'action.shoulder_pan.pos'
    joints, inputs = ({'pivot': {'position': {'column': n, 'unit': 'deg'}}} for n in names)
    columns = {'time': 'timestamp', 'joints': joints, 'inputs': inputs}
    bag = import_logs([data], ColumnMap.model_validate(columns), tmp_path / 'bag')
    recording = read_bag(bag, PENDULUM, TopicMap(input='none'))
    found = {f.code for f in traps(recording, LIMITED)}
    assert found == {'even_stamps', 'slow', 'positions_only', 'asked'}
    told, _ = look_at(Bag(recording), Model(PENDULUM), np.full(2, 0.01))
    assert found < {f.code for f in told}


@pytest.mark.parametrize('size', [0.0, 1.0, 1e150, 1e300])
@pytest.mark.parametrize('period', [1e-9, 1 / 30, 1e6])
@pytest.mark.filterwarnings('error')
def test_numbers_of_any_size(size, period):
    q, goal = np.random.default_rng(0).normal(size=(2, 200)) * size
    with np.errstate(all='ignore'):
        log = recorded(q, goal, period * np.arange(200))
    assert all('\n' not in f.what for f in traps(log, LIMITED))
