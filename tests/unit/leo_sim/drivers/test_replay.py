# SPDX-License-Identifier: Apache-2.0
"""A replayed bag gives back what was recorded, to the bit, around what is damaged."""

from functools import partial

import numpy as np
import pytest
from tests.messages import dynamic

from leo_diffmodel.bags.writer import BagWriter
from leo_msgs_py.cdr import joint_state, uint32
from leo_msgs_py.errors import UserError
from leo_msgs_py.values import JointStates
from leo_sim.description.robot import load_robot
from leo_sim.drivers.base import DriverOptions, EndOfRun, NotPossible
from leo_sim.drivers.replay import ReplayDriver

STAMPS = [0, 10_000_000, 20_000_000, 35_000_000, 45_000_000, 55_000_000]


def state(k: int, joint: str = 'pivot') -> JointStates:
    return JointStates(STAMPS[k], (joint,), np.array([0.1 * k]), np.array([-1.0 / (k + 1)]))


def encoded(k: int, joint: str = 'pivot') -> bytes:
    read = state(k, joint)
    return joint_state(read.stamp_ns, read.names, read.position, read.velocity)


def given(k: int, joint: str = 'pivot') -> bytes:
    return joint_state(STAMPS[k], [joint], effort=[0.5 * k if k < 5 else np.nan])


def given_before(k: int, joint: str = 'pivot') -> bytes:
    return dynamic(STAMPS[k], {joint: {'voltage': 0.5 * k * (k < 5), 'enabled': k < 5}})


APPLIED = {
    given: ('/robot/applied_voltage', 'sensor_msgs/msg/JointState'),
    given_before: ('/dynamic_joint_states', 'control_msgs/msg/DynamicJointState'),
}


def record(folder, joint='pivot', states=True, applied_from=0, applied=given):
    bag = BagWriter(folder)
    topics = [bag.add_topic('/robot/episode', 'std_msgs/msg/UInt32')]
    topics.append(bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState') if states else 0)
    topics.append(bag.add_topic(*APPLIED[applied]))
    bag.write(topics[0], uint32(4), 0)
    for k, stamp in enumerate(STAMPS):
        if k == 3:
            bag.write(topics[0], uint32(5), stamp)
        for _ in range(2 if states else 0):
            bag.write(topics[1], encoded(k, joint), stamp)
        if k >= applied_from:
            bag.write(topics[2], applied(k, joint), stamp)
        bag.flush()
    bag.close()
    return folder


def replay(bag, robot='pendulum') -> ReplayDriver:
    return ReplayDriver(DriverOptions(load_robot(robot), bag=str(bag)))


def play(driver):
    rows, gaps = [], []
    while True:
        rows.append((driver.read(), driver.write(np.array([9.0])), driver.starts))
        try:
            gaps.append(driver.advance(0.01))
        except EndOfRun as end:
            return rows, gaps, str(end)


@pytest.mark.parametrize('applied', APPLIED)
def test_states_inputs_gaps_and_episodes_come_back(tmp_path, applied):
    driver = replay(record(tmp_path / 'bag', applied=applied))
    assert driver.info.state_rate == pytest.approx(100.0)
    rows, gaps, end = play(driver)
    assert [r[0].stamp_ns for r in rows] == STAMPS
    for k, (read, sent, starts) in enumerate(rows):
        assert (read.position, read.velocity) == (state(k).position, state(k).velocity)
        assert sent.values.tolist() == [0.5 * k * (k < 5)] and sent.stamp_ns == STAMPS[k]
        assert sent.enabled.tolist() == [k < 5] and sent.interface == 'voltage'
        assert starts == (k >= 3)
    assert gaps == pytest.approx([0.01, 0.01, 0.015, 0.01, 0.01])
    assert 'ended after 6 states' in end


def test_an_unknown_input_is_none(tmp_path):
    rows, _, _ = play(replay(record(tmp_path / 'bag', applied_from=2)))
    assert [r[1] is None for r in rows] == [True, True, False, False, False, False]


def test_what_does_not_decode_or_fit_is_passed_over(tmp_path):
    bag = BagWriter(tmp_path / 'bag')
    states = bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
    applied = bag.add_topic(*APPLIED[given])
    for k in range(6):
        data = encoded(k)
        bag.write(states, data[:20] + b'\xff' * 40 if k == 2 else data, STAMPS[k])
        bag.write(applied, joint_state(STAMPS[k], ['pivot']) if k == 3 else given(k), STAMPS[k])
    bag.close()
    rows, _, _ = play(replay(tmp_path / 'bag'))
    assert [r[0].stamp_ns for r in rows] == STAMPS[:2] + STAMPS[3:]
    assert [r[1].values[0] for r in rows] == [0.0, 0.5, 1.0, 2.0, 0.0]


def test_a_recording_cannot_be_reset_or_freed(tmp_path):
    driver = replay(record(tmp_path / 'bag'))
    for change in (driver.reset, partial(driver.set_torque, False)):
        with pytest.raises(NotPossible, match='plays as it is'):
            change()


@pytest.mark.parametrize(
    ('options', 'said'),
    [
        ({'joint': 'elbow'}, r"has the joints \['elbow'\], robot pendulum has \['pivot'\]"),
        ({'states': False}, r"it has \['/robot/applied_voltage', '/robot/episode'\]"),
    ],
)
def test_a_bag_that_does_not_fit_is_refused(tmp_path, options, said):
    with pytest.raises(UserError, match=said):
        replay(record(tmp_path / 'bag', **options))


def test_a_missing_or_empty_bag_is_refused(tmp_path):
    with pytest.raises(UserError, match='no bag at'):
        replay(tmp_path / 'none')
    (tmp_path / 'empty').mkdir()
    with pytest.raises(UserError, match=r'no \.mcap file'):
        replay(tmp_path / 'empty')


def test_a_damaged_chunk_costs_itself(tmp_path, capsys):
    folder = record(tmp_path / 'bag')
    file = next(folder.glob('*.mcap'))
    whole = file.read_bytes()
    at = whole.index(encoded(2)) + len(encoded(2)) - 1  # the exponent of its velocity
    file.write_bytes(whole[:at] + bytes([whole[at] ^ 0x40]) + whole[at + 1 :])
    rows, _, _ = play(replay(folder))
    assert [r[0].stamp_ns for r in rows] == STAMPS[:2] + STAMPS[3:]
    assert capsys.readouterr().err.count('1 damaged records are left out') == 1
