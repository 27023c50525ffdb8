# SPDX-License-Identifier: Apache-2.0
"""A replayed bag gives back what was recorded, to the bit, cut short or not."""

import numpy as np
import pytest

from leo_diffmodel.bags.writer import BagWriter
from leo_msgs_py.errors import UserError
from leo_msgs_py.messages import UInt32
from leo_msgs_py.values import Applied, JointStates
from leo_msgs_py.wire.types import serialize
from leo_sim.drivers.base import DriverOptions, EndOfRun, NotPossible
from leo_sim.drivers.replay import ReplayDriver
from leo_sim.robot import load_robot

STAMPS = [0, 10_000_000, 20_000_000, 35_000_000, 45_000_000, 55_000_000]


def state(k: int, joint: str = 'pivot') -> JointStates:
    return JointStates(STAMPS[k], (joint,), np.array([0.1 * k]), np.array([-1.0 / (k + 1)]))


def record(folder, joint='pivot', states=True, applied_from=0):
    """Six states, each published twice, an input at each, a new episode before the fourth."""
    bag = BagWriter(folder)
    topics = [bag.add_topic('/robot/episode', 'std_msgs/msg/UInt32')]
    topics.append(bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState') if states else 0)
    topics.append(bag.add_topic('/dynamic_joint_states', 'control_msgs/msg/DynamicJointState'))
    bag.write(topics[0], serialize(UInt32(data=4)), 0)
    for k, stamp in enumerate(STAMPS):
        if k == 3:
            bag.write(topics[0], serialize(UInt32(data=5)), stamp)
        for _ in range(2 if states else 0):
            bag.write(topics[1], serialize(state(k, joint).to_message()), stamp)
        if k >= applied_from:
            applied = Applied(stamp, (joint,), np.array([0.5 * k]))
            bag.write(topics[2], serialize(applied.to_message()), stamp)
        bag.flush()
    bag.close()
    return folder


def replay(bag, robot='pendulum') -> ReplayDriver:
    return ReplayDriver(DriverOptions(load_robot(robot), bag=str(bag)))


def play(driver):
    """Everything a node would publish: (state, applied, starts), and the gaps between."""
    rows, gaps = [], []
    while True:
        rows.append((driver.read(), driver.write(np.array([9.0])), driver.starts))
        try:
            gaps.append(driver.advance(0.01))
        except EndOfRun as end:
            return rows, gaps, str(end)


def test_states_inputs_gaps_and_episodes_come_back(tmp_path):
    driver = replay(record(tmp_path / 'bag'))
    assert driver.info.state_rate == pytest.approx(100.0)
    rows, gaps, end = play(driver)
    assert [r[0].stamp_ns for r in rows] == STAMPS
    for k, (read, applied, starts) in enumerate(rows):
        assert serialize(read.to_message()) == serialize(state(k).to_message())
        assert applied.values.tolist() == [0.5 * k] and applied.stamp_ns == STAMPS[k]
        assert starts == (k >= 3)
    assert gaps == pytest.approx([0.01, 0.01, 0.015, 0.01, 0.01])
    assert 'ended after 6 states' in end


def test_unknown_input_is_nan_not_zero(tmp_path):
    rows, _, _ = play(replay(record(tmp_path / 'bag', applied_from=2)))
    assert [np.isnan(r[1].values[0]) for r in rows] == [True, True, False, False, False, False]


def test_a_bag_cut_short_plays_up_to_the_cut(tmp_path):
    folder = record(tmp_path / 'bag')
    file = next(folder.glob('*.mcap'))
    whole = file.read_bytes()
    file.write_bytes(whole[: whole.rindex(serialize(state(4).to_message())) + 10])
    rows, _, _ = play(replay(folder))
    assert [r[0].stamp_ns for r in rows] == STAMPS[: len(rows)] and 4 <= len(rows) <= 5


def test_a_recording_cannot_be_reset_or_freed(tmp_path):
    driver = replay(record(tmp_path / 'bag'))
    with pytest.raises(NotPossible, match='plays as it is'):
        driver.reset()
    with pytest.raises(NotPossible, match='plays as it is'):
        driver.set_torque(False)


@pytest.mark.parametrize(
    ('options', 'said'),
    [
        ({'joint': 'elbow'}, r"has the joints \['elbow'\], robot pendulum has \['pivot'\]"),
        (
            {'states': False},
            r"no /joint_states; it has \['/dynamic_joint_states', '/robot/episode'\]",
        ),
    ],
)
def test_a_bag_that_does_not_fit_is_refused(tmp_path, options, said):
    with pytest.raises(UserError, match=said):
        replay(record(tmp_path / 'bag', **options))


def test_a_missing_or_empty_bag_is_refused(tmp_path):
    with pytest.raises(UserError, match='give a rosbag2 folder'):
        replay(tmp_path / 'none')
    (tmp_path / 'empty').mkdir()
    with pytest.raises(UserError, match=r'no \.mcap file'):
        replay(tmp_path / 'empty')
