# SPDX-License-Identifier: Apache-2.0
"""What is not the robot is found in a recording, cut out, and not seen where there is nothing."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tests.hand import carried, led, SECONDS, shove, spoilt
from tests.models import stepped
from tests.robots import FLYWHEEL
from tests.simulate import bag, DT, NOISE, of_robot, PENDULUM, record, steps, TORQUE

from leo_diffmodel.bags.cut import cut_bag
from leo_diffmodel.bags.episode import between
from leo_diffmodel.bags.recording import Episode, read_bag, Recording
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.bags.types import at_rows
from leo_diffmodel.check.check import forces
from leo_diffmodel.compare.sizes import gravity_scale, mass_scale
from leo_diffmodel.outside.finding import ERROR
from leo_diffmodel.outside.frozen import frozen
from leo_diffmodel.outside.outside import moved_from_outside, not_the_robot, share_outside, without
from leo_diffmodel.verbs.bag import main
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot, Robot
from leo_sim.effects import place, Placed
from leo_sim.model import Model

SERVO = load_robot('servo_pendulum')
WRONG = {
    'nothing': lambda r, g: (),
    'friction': lambda r, g: (
        place(r, 'coulomb_friction', 'pivot', c=0.1 * g),
        place(r, 'viscous_friction', 'pivot', b=0.01 * g),
    ),
    'payload': lambda r, g: (place(r, 'link_mass', r.moving_links[-1], m=mass_scale(r)),),
    'gain': lambda r, g: (place(r, 'torque_scale', 'pivot', k=0.8),),
    'late': lambda r, g: (place(r, 'command_delay', 'pivot', delay=0.03),),
}


def wrong(robot: Robot, what: str) -> tuple:
    return WRONG[what](robot, gravity_scale(robot))


def found(recording: Recording, robot: Robot) -> list[tuple[str, float, float]]:
    return [(f.code, *f.where[0]) for f in moved_from_outside(recording, Model(robot))]


@pytest.mark.parametrize('robot', [PENDULUM, TORQUE, SERVO], ids=lambda r: r.name)
@pytest.mark.parametrize('what', WRONG)
def test_an_honest_recording_of_a_wrong_model_has_nothing_from_outside(robot, what):
    assert found(record(robot, *wrong(robot, what), seconds=SECONDS, seed=3), robot) == []


@pytest.mark.parametrize('robot', [PENDULUM, TORQUE, SERVO], ids=lambda r: r.name)
@pytest.mark.parametrize('what', WRONG)
def test_shoves_are_found_where_they_are(robot, what):
    push = shove(robot, 4.0, 12.0)
    pushed = record(robot, *wrong(robot, what), seconds=SECONDS, seed=3, push=push)
    seen = found(pushed, robot)
    assert len(seen) == 2 and all(kind in ('push', 'blocked') for kind, *_ in seen)
    for (_, begin, end), at in zip(seen, (4.0, 12.0), strict=True):
        assert begin == pytest.approx(at, abs=0.1) and end == pytest.approx(at + 0.15, abs=0.1)


@pytest.mark.parametrize('robot', [PENDULUM, TORQUE, SERVO], ids=lambda r: r.name)
@pytest.mark.parametrize('held', [False, True])
def test_a_hand_is_found_all_along(robot, held):
    recording = led(robot, 3, held)
    stretches = moved_from_outside(recording, Model(robot))
    assert [f.code for f in stretches] == ['hand']
    assert share_outside([recording], [stretches]) > 0.95
    assert without([recording], [stretches]) == []
    (told,) = forces(recording, Model(robot))
    assert told.severity == ERROR and 'pivot' in told.what


@pytest.mark.parametrize('seed', [3, 4])
def test_a_hand_is_found_though_the_motor_carries_more_than_the_weight(seed):
    assert {k for k, *_ in found(carried(TORQUE, seed, 1.1), TORQUE)} == {'hand'}


@pytest.mark.parametrize('stronger', [1.0, 4.0, 10.0])
def test_a_motor_that_explains_the_motion_is_no_hand_however_strong_it_is(stronger):
    """Dry friction and the motor's strength are unknown; the voltage is steps and their sign."""
    robot, t = FLYWHEEL, DT * np.arange(round(SECONDS / DT))
    inputs = 6 * np.sign(np.sin(1.3 * t)) * (0.4 + 0.6 * np.sin(0.2 * t) ** 2)
    wrong = (
        place(robot, 'torque_scale', 'shaft', k=stronger),
        place(robot, 'coulomb_friction', 'shaft', c=0.004),
    )
    assert found(record(robot, *wrong, seconds=SECONDS, inputs=inputs[:, None]), robot) == []


def late(rates: np.ndarray) -> np.ndarray:
    return np.concatenate([np.repeat(rates[:1], 18, axis=0), rates[:-18]])


FALSE_RATES = {
    'in another unit': lambda dq: 6.4 * dq,
    'of the other sign': lambda dq: -dq,
    'late by 0.18 s': late,
    'with a zero that is off': lambda dq: dq + 0.5,
    'none': lambda dq: 0.0 * dq,
}


@pytest.mark.parametrize('what', FALSE_RATES)
@pytest.mark.parametrize(
    'recording',
    [
        record(TORQUE, seconds=SECONDS, seed=3, push=shove(TORQUE, 12.0)),
        record(PENDULUM, seconds=SECONDS, seed=3),
        led(TORQUE, 3),
    ],
    ids=['shoved', 'alone', 'led'],
)
def test_a_false_rate_changes_nothing_of_what_is_found(recording, what):
    robot = PENDULUM if recording.input == 'voltage' else TORQUE
    false = spoilt(recording, dq=FALSE_RATES[what](recording.episodes[0].dq))
    kinds = [[k for k, *_ in found(r, robot)] for r in (recording, false)]
    assert kinds[0] == kinds[1]


def stops(inputs: float, angle: float, *effects: Placed) -> Recording:
    """The joint stands at an angle for 3 s while the motor pushes; then it is let go."""
    parts = [steps(TORQUE, 8.0, 3), np.full((300, 1), inputs), steps(TORQUE, 9.0, 4)]
    rng = np.random.default_rng(0)
    log = record(TORQUE, *effects, seconds=SECONDS, inputs=np.concatenate(parts))
    (e,) = log.episodes
    e.q[800:1100] = angle + rng.normal(0, NOISE[0], (300, 1))
    e.dq[800:1100] = rng.normal(0, NOISE[1], (300, 1))
    pieces = (at_rows(e, s) for s in (slice(0, 800), slice(800, 1100), slice(1100, None)))
    return replace(log, episodes=tuple(pieces))


def test_a_blocked_joint_is_found():
    ((kind, begin, end),) = found(stops(4.0, 0.3), TORQUE)
    assert (kind, begin, end) == ('blocked', pytest.approx(8, abs=0.2), pytest.approx(11, abs=0.2))


@pytest.mark.parametrize(
    ('low', 'what'), [(None, 'at its own stop while'), (-1.5, 'stands while')]
)
def test_a_joint_that_meets_its_own_stop_is_said_to(low, what):
    robot, t = load_robot('so101'), 0.02 * np.arange(300)
    goals = np.outer(np.sin(1.5 * t), [0.1] * 5 + [0.6])
    q, dq = stepped(Model(robot, engine='rigid'), goals, 0.02)
    noisy = dq[:300] + 0.02 * np.random.default_rng(1).standard_normal((300, 6))
    episode = Episode(t, q[:300], noisy, goals, np.ones((300, 6), bool))
    joints = tuple(
        replace(j, limits=(low, 3.0)) if low and j.name == 'gripper' else j for j in robot.joints
    )
    seen = moved_from_outside(
        of_robot(robot, episode, period=0.02), Model(replace(robot, joints=joints))
    )
    assert {f.code for f in seen} == {'blocked'}
    assert all(
        f.what.startswith('gripper: ') and what in f.what and f.what.endswith('N m') for f in seen
    )


def test_a_weak_motor_that_its_weight_stops_is_not_blocked():
    weak, angle = 0.65, np.pi - 1.2
    balance = -float(Model(TORQUE).rigid.load(np.array([[angle]]))[0, 0]) / weak
    stopped = stops(balance, angle, place(TORQUE, 'torque_scale', 'pivot', k=weak))
    assert found(stopped, TORQUE) == []


def test_a_speed_at_its_largest_value_is_cut_out():
    clean = record(PENDULUM, seconds=SECONDS)
    dq = clean.episodes[0].dq
    most = float(np.quantile(np.abs(dq), 0.8))
    clipped = spoilt(clean, dq=np.clip(dq, -most, most))
    assert not_the_robot(clean, Model(PENDULUM)) == []
    spans = [span for f in frozen(clipped) for span in f.spans]
    cut = not_the_robot(clipped, Model(PENDULUM))
    assert spans and all(any(a < begin and end < b for a, b in cut) for begin, end in spans)


def test_missing_samples_are_a_gap_and_no_force():
    clean = record(PENDULUM, seconds=SECONDS)
    gappy = replace(clean, episodes=(at_rows(clean.episodes[0], np.r_[0:500, 508:2000]),))
    assert moved_from_outside(gappy, Model(PENDULUM)) == []
    assert not_the_robot(gappy, Model(PENDULUM)) == [pytest.approx((4.89, 5.18))]


def test_without_splits_there_and_drops_short_pieces():
    pushed = record(PENDULUM, seconds=SECONDS, seed=3, push=shove(PENDULUM, 0.4, 12.0))
    (rest,) = without([pushed], [moved_from_outside(pushed, Model(PENDULUM))])
    assert len(rest.episodes) == 2 and rest.episodes[0].t[0] > 0.5
    for a, b in pairwise(rest.episodes):
        assert a.t[-1] < 11.95 and b.t[0] > 12.2
    assert moved_from_outside(rest, Model(PENDULUM)) == []
    assert without([rest], [[]]) == [rest]


def test_between_takes_a_part_and_refuses_what_is_none():
    clean = record(PENDULUM, seconds=SECONDS)
    (part,) = between(clean, 2.0, 5.0).episodes
    assert (part.t[0], part.t[-1], len(part.inputs)) == (2.0, 5.0, len(part.t))
    assert between(clean).episodes[0].t[-1] == clean.episodes[0].t[-1]
    for begin, end in ((5.0, 2.0), (30.0, None), (-1.0, None), (float('nan'), None)):
        with pytest.raises(UserError):
            between(clean, begin, end)


def test_a_cut_bag_reads_as_the_part_of_the_recording(tmp_path):
    whole = bag(tmp_path / 'whole', record(PENDULUM, seconds=6.0))
    cut_bag(whole, tmp_path / 'part', 1.0, 3.0)
    (part,), (full,) = (read_bag(p, PENDULUM).episodes for p in (tmp_path / 'part', whole))
    inside = (full.t > 0.995) & (full.t < 3.005)
    assert np.array_equal(part.q, full.q[inside])
    assert np.allclose(part.inputs[:-1], full.inputs[inside][:-1])
    with pytest.raises(UserError, match='exists'):
        cut_bag(whole, tmp_path / 'part', 1.0, 3.0)
    with pytest.raises(UserError, match='no joint states'):
        cut_bag(whole, tmp_path / 'late', 50.0)
    assert not (tmp_path / 'late').exists()


def test_leo_bag_cut_leaves_out_a_shove(tmp_path, capsys):
    pushed = record(PENDULUM, seconds=SECONDS, seed=3, push=shove(PENDULUM, 12.0))
    whole, new = bag(tmp_path / 'whole', pushed), tmp_path / 'new'
    words = ['cut', str(whole), '-o', str(new), '--without-outside', '--model', 'pendulum']
    assert main([*words, '--from', '1']) == 0
    assert f'next: leo bag info {new}' in capsys.readouterr().out
    episodes = read_bag(new, PENDULUM).episodes
    assert len(episodes) == 2
    (gap,) = pairwise(episodes)
    edges = gap[0].t[-1] - 0.1, gap[1].t[0] + 0.1
    assert not_the_robot(read_bag(new, PENDULUM), Model(PENDULUM))[0] == pytest.approx(edges)
    with pytest.raises(UserError, match='--model'):
        main(['cut', str(whole), '-o', str(tmp_path / 'x'), '--without-outside'])


def test_a_topic_map_says_whether_the_base_was_held(tmp_path):
    path = bag(tmp_path / 'whole', record(PENDULUM, seconds=2.0))
    (tmp_path / 'map.yaml').write_text('held: true\n')
    assert not read_bag(path, PENDULUM).held
    assert read_bag(path, PENDULUM, tmp_path / 'map.yaml').held
    assert not read_bag(path, PENDULUM, TopicMap(held=False)).held
