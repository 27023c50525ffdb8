# SPDX-License-Identifier: Apache-2.0
"""Any robot's bag becomes the same recording: exact, cut at breaks, or refused in one line."""

from dataclasses import replace
from pathlib import Path

from mcap.records import Message
import numpy as np
import pytest
from tests.messages import bag_of, command, dynamic, message
from tests.places import DATA
from tests.simulate import PENDULUM, TORQUE

from leo_diffmodel.bags import recording as recording_file
from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.bags.mend import mended
from leo_diffmodel.bags.recording import read_bag, read_both_ways
from leo_diffmodel.bags.topic_map import JointMap, TopicMap
from leo_diffmodel.bags.types import DYNAMIC_JOINT_STATE, FLOAT64_ARRAY, JOINT_STATE, UINT32
from leo_msgs_py.bag_contents import Logged, logged
from leo_msgs_py.cdr import joint_state, uint32
from leo_msgs_py.errors import UserError

PERIOD = 10_000_000
OLD_BAGS = DATA / 'bags_of_2026_11'
KINDS = {
    'joint_states': JOINT_STATE,
    'applied_voltage': JOINT_STATE,
    'applied_effort': JOINT_STATE,
    'dynamic_joint_states': DYNAMIC_JOINT_STATE,
    'commands': FLOAT64_ARRAY,
    'episode': UINT32,
    'chatter': 'std_msgs/msg/String',
}
VOLTS = '/robot/applied_voltage'
NAN = float('nan')
CHATTER = [('/chatter', 0, message('std_msgs/msg/String', 'x'))]


def swing(count: int = 400, period: float = 0.01) -> Run:
    """A swing, with a different voltage at every step."""
    t = np.arange(count) * period
    voltage = np.random.default_rng(0).normal(size=count)
    inputs = {'pivot': {'voltage': voltage, 'enabled': np.ones(count)}}
    return Run(t, ['pivot'], np.sin(t)[:, None], np.cos(t)[:, None], inputs=inputs)


def write_messages(folder: Path, messages: list[tuple[str, int, bytes]]) -> Path:
    """A bag of (topic, log time [ns], CDR bytes)."""
    rows = ((t, KINDS[t.rpartition('/')[2]], log_ns, data) for t, log_ns, data in messages)
    return bag_of(folder, *rows)


def state(stamp_ns: int, q: float, dq: float = 0.0, effort: float | None = None) -> bytes:
    return joint_state(stamp_ns, ['pivot'], [q], [dq], () if effort is None else [effort])


def applied(stamp_ns: int, volts: float) -> bytes:
    return joint_state(stamp_ns, ['pivot'], effort=[volts])


def only(names: list[str], q: list[float]) -> list[tuple[str, int, bytes]]:
    return [('/joint_states', 0, joint_state(0, names, q))]


def still(count: int, start: int = 0) -> list[tuple[str, int, bytes]]:
    return [('/joint_states', k * PERIOD, state(k * PERIOD, 0.1)) for k in range(start, count)]


def test_what_is_written_is_read_to_the_bit(tmp_path):
    run = swing()
    recording = read_bag(write_runs(tmp_path / 'bag', [run, run], {'robot': 'pendulum'}), PENDULUM)
    assert (recording.joints, recording.actuators) == (('pivot',), ('pivot',))
    assert (recording.input, recording.command_period) == ('voltage', PENDULUM.control_period)
    assert len(recording.episodes) == 2 and recording.warnings == ()
    for episode in recording.episodes:
        assert np.array_equal(episode.q, run.q) and np.array_equal(episode.dq, run.dq)
        assert np.array_equal(episode.inputs[:, 0], run.inputs['pivot']['voltage'])
        assert episode.enabled.all() and episode.effort is None
        np.testing.assert_allclose(episode.t - episode.t[0], run.t, atol=1e-9)


@pytest.mark.parametrize(('publish_time', 'told'), [(3, 3), (0, 7), (2**64 - 1, 7)])
def test_without_a_publish_time_a_message_counts_from_when_it_was_logged(publish_time, told):
    message = Message(channel_id=1, log_time=7, data=b'x', publish_time=publish_time, sequence=0)
    assert logged(message) == Logged(7, b'x', told)


def test_motor_off_is_not_0_volts(tmp_path):
    run = swing(50)
    run.inputs['pivot']['enabled'][20:] = 0.0
    recording = read_bag(write_runs(tmp_path / 'bag', [run], {}), PENDULUM)
    (episode,) = recording.episodes
    assert episode.enabled[:20].all() and not episode.enabled[20:].any()
    assert not episode.inputs[20:].any() and recording.warnings == ()


def test_an_input_that_is_not_known_is_no_free_motor(tmp_path):
    run = swing(50)
    run.inputs['pivot']['voltage'][20:30] = NAN
    recording = read_bag(write_runs(tmp_path / 'bag', [run], {}), PENDULUM)
    (episode,) = recording.episodes
    assert episode.enabled.all() and set(episode.inputs[20:30, 0]) == {episode.inputs[19, 0]}
    assert '10 inputs with NaN or of a wrong length left out' in recording.warnings[0]


@pytest.mark.parametrize('name', ['swing', 'cut'])
def test_bags_of_before_2026_12_read_as_they_did(name):
    recording = read_bag(OLD_BAGS / name, PENDULUM)
    expected = np.load(OLD_BAGS / f'{name}.npz')
    found = {
        f'{field}_{k}': getattr(episode, field)
        for k, episode in enumerate(recording.episodes)
        for field in ('t', 'q', 'dq', 'inputs', 'enabled')
    }
    assert found.keys() == set(expected)
    for key, values in found.items():
        np.testing.assert_array_equal(values, expected[key])
    assert not recording.episodes[0].enabled.all()
    assert ['cut short' in warning for warning in recording.warnings] == [True] * (name == 'cut')


def test_applied_voltages_and_dynamic_joint_states_read_alike(tmp_path):
    free = [(1.0, 1.0), (0.0, 0.0), (2.0, 1.0), (0.0, 0.0)]
    volts = [v if on else NAN for v, on in free]
    new = [(VOLTS, k * PERIOD, applied(k * PERIOD, v)) for k, v in enumerate(volts)]
    topic = '/dynamic_joint_states'
    said = [{'pivot': {'voltage': v, 'enabled': on}} for v, on in free]
    old = [(topic, k * PERIOD, dynamic(k * PERIOD, s)) for k, s in enumerate(said)]
    for name, log in (('new', new), ('old', old), ('both', new + old[:1])):
        recording = read_bag(write_messages(tmp_path / name, still(4) + log), PENDULUM)
        (episode,) = recording.episodes
        assert episode.inputs[:, 0].tolist() == [1.0, 0.0, 2.0, 0.0]
        assert episode.enabled[:, 0].tolist() == [True, False, True, False]
        assert recording.warnings == ()


def test_commands_of_which_none_decodes_are_no_input(tmp_path):
    log = [('/voltage_controller/commands', 0, command(1.0)[:20])]
    recording = read_bag(write_messages(tmp_path / 'bag', still(5) + log), PENDULUM)
    assert recording.input == 'none'
    assert '1 messages could not be decoded' in recording.warnings[0]


def test_the_topic_says_the_unit(tmp_path):
    log = [(f'/leo1{VOLTS}', 0, applied(0, 9.0)), ('/leo1/robot/applied_effort', 0, applied(0, 1))]
    bag = write_messages(tmp_path / 'bag', still(5) + log)
    assert set(read_bag(bag, PENDULUM).episodes[0].inputs[:, 0]) == {9.0}
    assert set(read_bag(bag, TORQUE).episodes[0].inputs[:, 0]) == {1.0}
    volts = write_messages(tmp_path / 'volts', still(5) + log[:1])
    with pytest.raises(UserError, match=rf'by voltage \(/leo1{VOLTS}\).*takes torque'):
        read_bag(volts, TORQUE)


def test_a_clock_that_was_set_back_is_told(tmp_path):
    def log(back, *more):
        at = [k * PERIOD - (back if k > 200 else 0) for k in range(400)]
        rows = [('/joint_states', k * PERIOD, state(t, 0.1 + 1e-3 * k)) for k, t in enumerate(at)]
        return write_messages(tmp_path / str(len(more) + back), [*rows, *more])

    told = read_bag(log(150 * PERIOD), PENDULUM).warnings
    assert any('stamps of the joint states go back, at 2.00 s by 1.49 s' in w for w in told)
    resets = [('/robot/episode', k * PERIOD, uint32(k)) for k in (0, 201)]
    for path in (log(0), log(150 * PERIOD, *resets)):
        assert not any('go back' in w for w in read_bag(path, PENDULUM).warnings)


def test_inputs_faster_than_states_are_averaged(tmp_path):
    log = [('/joint_states', k * PERIOD, state(k * PERIOD, 0.1)) for k in range(3)]
    for stamp, volts in ((0, 1.0), (PERIOD // 4, 5.0), (PERIOD, -2.0)):
        log.append((VOLTS, stamp, applied(stamp, volts)))
    (episode,) = read_bag(write_messages(tmp_path / 'bag', log), PENDULUM).episodes
    assert episode.inputs[:, 0].tolist() == [0.25 * 1.0 + 0.75 * 5.0, -2.0, -2.0]


def test_both_ways_of_holding_inputs_are_read_from_one_decoded_bag(tmp_path, monkeypatch):
    path = write_runs(tmp_path / 'bag', [swing()], {})
    each = [read_bag(path, PENDULUM, TopicMap(hold=hold)) for hold in ('next', 'previous')]
    decoded, whole = [], recording_file.read_states
    monkeypatch.setattr(recording_file, 'read_states', lambda *a: decoded.append(1) or whole(*a))
    both = read_both_ways(path, PENDULUM, TopicMap())
    assert len(decoded) == 1
    for mine, its in zip(both, each, strict=True):
        assert (mine.sha256, mine.warnings) == (its.sha256, its.warnings)
        assert mine.episodes[0].inputs == pytest.approx(its.episodes[0].inputs)
    assert not np.array_equal(both[0].episodes[0].inputs, both[1].episodes[0].inputs)


def test_hold_previous_puts_an_input_before_its_stamp(tmp_path):
    run = swing(50)
    bag = write_runs(tmp_path / 'bag', [run], {})
    (tmp_path / 'map.yaml').write_text('hold: previous\n')
    (episode,) = read_bag(bag, PENDULUM, tmp_path / 'map.yaml').episodes
    assert np.array_equal(episode.inputs[:-1, 0], run.inputs['pivot']['voltage'][1:])


def test_commands_come_from_log_time_mapped_by_the_median_delay(tmp_path):
    epoch, delay = 1_700_000_000_000_000_000, 3_000_000
    logged_at = [epoch + delay + k * PERIOD + (k % 3) * 1000 for k in range(30)]
    log = [('/joint_states', at, state(k * PERIOD, 0.1)) for k, at in enumerate(logged_at)]
    volts = np.arange(6.0)
    for k, value in enumerate(volts):
        at = epoch + delay + 1000 + 5 * k * PERIOD
        log.append(('/voltage_controller/commands', at, command(value)))
    recording = read_bag(write_messages(tmp_path / 'bag', log), PENDULUM)
    (episode,) = recording.episodes
    assert np.array_equal(episode.inputs[:, 0], np.repeat(volts, 5))
    assert recording.command_period == pytest.approx(0.05)


def test_effort_is_the_input_of_last_resort_and_nothing_is_passive(tmp_path):
    log = [('/joint_states', k * PERIOD, state(k * PERIOD, 0.1, 0.0, 0.5 * k)) for k in range(5)]
    driven = read_bag(write_messages(tmp_path / 'driven', log), TORQUE)
    assert driven.input == 'torque'
    assert driven.episodes[0].inputs[:, 0].tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert np.array_equal(driven.episodes[0].effort, driven.episodes[0].inputs)
    passive = read_bag(write_messages(tmp_path / 'passive', still(5)), PENDULUM)
    assert passive.input == 'none' and not passive.episodes[0].enabled.any()


def test_topic_map_renames_turns_and_shifts(tmp_path):
    run = swing(50)
    renamed = replace(run, joints=['hinge'], inputs={'hinge': run.inputs['pivot']})
    bag = write_runs(tmp_path / 'bag', [renamed], {})
    (tmp_path / 'map.yaml').write_text(
        'joints: {pivot: {name: hinge, sign: -1, offset: 0.5}}\n'
        'topics: {joint_states: /joint_states}\n'
    )
    (episode,) = read_bag(bag, PENDULUM, tmp_path / 'map.yaml').episodes
    np.testing.assert_array_equal(episode.q, 0.5 - run.q)
    np.testing.assert_array_equal(episode.dq, -run.dq)
    np.testing.assert_array_equal(episode.inputs[:, 0], -run.inputs['pivot']['voltage'])


def test_a_namespace_is_found_and_two_are_asked_about(tmp_path):
    one = [('/leo1/joint_states', log, message) for _, log, message in still(5)]
    assert len(read_bag(write_messages(tmp_path / 'one', one), PENDULUM).episodes) == 1
    two = one + [('/leo2/joint_states', log, message) for _, log, message in still(5)]
    with pytest.raises(UserError, match=r'several topics.*/leo1/joint_states.*/leo2/joint_states'):
        read_bag(write_messages(tmp_path / 'two', two), PENDULUM)


def test_repeated_states_are_dropped_and_a_gap_splits(tmp_path):
    log = still(20) + [('/joint_states', 20 * PERIOD, state(19 * PERIOD, 0.1))] + still(60, 40)
    recording = read_bag(write_messages(tmp_path / 'bag', log), PENDULUM)
    assert [len(episode.t) for episode in recording.episodes] == [20, 20]
    assert [w.split(': ')[1] for w in recording.warnings] == ['1 gaps; split there']


def test_states_that_come_too_seldom_for_a_motion_are_one_line(tmp_path):
    bag = write_runs(tmp_path / 'bag', [swing(period=1e6)], {})
    with pytest.raises(UserError, match=r'bag: states come 1e\+06 s apart'):
        read_bag(bag, PENDULUM)


def test_stamps_jumping_back_split_and_keep_their_inputs(tmp_path):
    log = []
    for run, volts in enumerate((1.0, 2.0)):
        for k in range(20):
            at, stamp = (20 * run + k) * PERIOD, k * PERIOD
            log.append(('/joint_states', at, state(stamp, 0.1)))
            log.append((VOLTS, at, applied(stamp, volts)))
    first, second = read_bag(write_messages(tmp_path / 'bag', log), PENDULUM).episodes
    assert set(first.inputs[:, 0]) == {1.0} and set(second.inputs[:, 0]) == {2.0}
    assert len(first.t) == len(second.t) == 20


@pytest.mark.parametrize('late', [-2, -1, 0, 1, 2])
def test_an_episode_number_that_comes_early_or_late_still_cuts_at_the_reset(tmp_path, late):
    reset = [2.0] * 30 + [0.0] * 30
    log = [('/joint_states', k * PERIOD, state(k * PERIOD, q)) for k, q in enumerate(reset)]
    log.append(('/robot/episode', 0, uint32(4)))
    log.append(('/robot/episode', (30 + late) * PERIOD - 1, uint32(5)))
    recording = read_bag(write_messages(tmp_path / 'bag', log), PENDULUM)
    assert [float(np.ptp(episode.q)) for episode in recording.episodes] == [0.0, 0.0]
    assert [len(episode.t) for episode in recording.episodes] == [30, 30]


def test_without_episodes_a_jump_splits_but_noise_and_impacts_do_not(tmp_path):
    rng = np.random.default_rng(1)
    t = np.arange(300) * 0.01
    q = np.where(t < 1.5, np.sin(3 * t), 0.5 + np.sin(3 * t))
    dq = np.where(t < 1.0, 3 * np.cos(3 * t), 3 * np.cos(3 * t) - 4.0)
    q = q - np.where(t < 1.0, 0.0, 4.0 * (t - 1.0))
    q, dq = q + rng.normal(0, 0.003, t.shape), dq + rng.normal(0, 0.1, t.shape)
    log = [('/joint_states', k * PERIOD, state(k * PERIOD, q[k], dq[k])) for k in range(len(t))]
    recording = read_bag(write_messages(tmp_path / 'bag', log), PENDULUM)
    assert [len(episode.t) for episode in recording.episodes] == [150, 150]
    assert '1 jumps no model can make' in recording.warnings[0]


def test_wrapped_angles_are_unwrapped(tmp_path):
    t = np.arange(300) * 0.01
    q = 5.0 * t
    read = (q + np.pi) % (2 * np.pi) - np.pi
    log = [('/joint_states', k * PERIOD, state(k * PERIOD, x, 5.0)) for k, x in enumerate(read)]
    recording = read_bag(write_messages(tmp_path / 'bag', log), PENDULUM)
    np.testing.assert_allclose(recording.episodes[0].q[:, 0], q, atol=1e-9)
    assert '2 wraps' in recording.warnings[0]


def test_nan_is_dropped_and_counted(tmp_path):
    log = still(50)
    log[10] = ('/joint_states', 10 * PERIOD, state(10 * PERIOD, NAN))
    recording = read_bag(write_messages(tmp_path / 'bag', log), PENDULUM)
    assert len(recording.episodes[0].t) == 49
    assert '1 samples with NaN left out' in recording.warnings[0]


@pytest.mark.parametrize(
    'mapping',
    [TopicMap(time_scale=0.5), TopicMap(joints={'pivot': JointMap(scale=0.02, sign=-1)})],
)
def test_rates_that_nobody_measured_follow_the_mended_angles_and_time(tmp_path, mapping):
    run = replace(swing(), dq=None)
    bag = write_runs(tmp_path / 'bag', [run], {})
    plain = read_bag(bag, PENDULUM)
    np.testing.assert_allclose(plain.episodes[0].dq[1:-1, 0], np.cos(run.t)[1:-1], atol=1e-4)
    assert 'no velocities' in plain.warnings[0]
    for recording in (read_bag(bag, PENDULUM, mapping), mended(plain, mapping)):
        (episode,) = recording.episodes
        np.testing.assert_allclose(episode.dq, np.gradient(episode.q, episode.t, axis=0))


def test_uneven_rates_and_states_before_the_first_input(tmp_path):
    stamps = np.cumsum(np.random.default_rng(2).integers(2, 12, 200)) * 1_000_000
    log = [('/joint_states', int(s), state(int(s), 0.1)) for s in stamps]
    log.append((VOLTS, int(stamps[5]), applied(int(stamps[5]), 3.0)))
    (episode,) = read_bag(write_messages(tmp_path / 'bag', log), PENDULUM).episodes
    assert len(episode.t) == 195 and (episode.inputs == 3.0).all()
    np.testing.assert_allclose(np.diff(episode.t), np.diff(stamps[5:]) * 1e-9)


@pytest.mark.parametrize(
    ('log', 'message'),
    [
        (CHATTER, 'no topic /joint_states; it has /'),
        (only(['elbow'], [0.0]), 'pivot are not on .* are elbow'),
        (only(['pivot'], [NAN]), 'every sample.* NaN'),
        (only(['pivot', 'hand'], [0.1]), r'1 position\(s\) for 2 names of joints'),
        (only(['pivot'], []), 'have no positions'),
        (only(['pivot', 'pivot'], [0.1, 0.2]), 'names pivot twice'),
        (still(1), 'record longer'),
        ([], 'is empty: nothing was recorded'),
    ],
)
def test_unusable_bags_are_refused_in_one_line(tmp_path, log, message):
    with pytest.raises(UserError, match=message) as refusal:
        read_bag(write_messages(tmp_path / 'bag', log), PENDULUM)
    assert '\n' not in str(refusal.value)


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('hold: later\n', "hold: Input should be 'next' or 'previous', found 'later'"),
        ('topic: {}\n', "unknown key 'topic'; did you mean topics?"),
        ('topics: {joint_states: /arm}\n', 'no topic /arm; it has /joint_states'),
        ('input: commands\n', 'no input on commands'),
        ('input: applied\n', 'no input on applied'),
        ('joints: {pivot: {speed_scale: 0}}', 'a scale is a number other than 0'),
        ('joints: {pivot: {input_late: 99}}', 'less than or equal to 10'),
        ('time_scale: -1', 'greater than 0'),
        ('- a\n', 'expected a mapping'),
        ('{', 'not a YAML file'),
    ],
)
def test_wrong_topic_maps_are_refused(tmp_path, text, message):
    (tmp_path / 'map.yaml').write_text(text)
    bag = write_messages(tmp_path / 'bag', still(5))
    with pytest.raises(UserError) as refusal:
        read_bag(bag, PENDULUM, tmp_path / 'map.yaml')
    assert message in str(refusal.value) and '\n' not in str(refusal.value)


def test_applied_inputs_of_other_joints_are_never_passed_over_in_silence(tmp_path):
    log = [
        ('/dynamic_joint_states', 0, dynamic(0, {'hinge': {'voltage': 1.0, 'enabled': 1.0}})),
        (VOLTS, 0, joint_state(0, ['hinge'], effort=[1.0])),
    ]
    recording = read_bag(write_messages(tmp_path / 'bag', still(10) + log), PENDULUM)
    assert recording.input == 'none'
    told = ' '.join(recording.warnings)
    for there in ('hinge: voltage, enabled', 'hinge'):
        assert f'no usable voltage of pivot (there is {there}); inputs taken from: none' in told


def test_the_command_period_of_a_foreign_bag_is_in_robot_time(tmp_path):
    wall = 3  # the robot ran three times as fast as its clock
    log = []
    for k in range(200):
        log.append(('/joint_states', k * PERIOD // wall, state(k * PERIOD, 0.1)))
        log.append((VOLTS, k * PERIOD // wall, applied(k * PERIOD, 1.0)))
        if k % 5 == 0:
            at = k * PERIOD // wall + 400_000 + 100_000 * (k % 3)
            log.append(('/voltage_controller/commands', at, command(1.0)))
    recording = read_bag(write_messages(tmp_path / 'bag', log), PENDULUM)
    assert recording.command_period == pytest.approx(0.05)
