# SPDX-License-Identifier: Apache-2.0
"""The robot node with a position servo: goals in, goals recorded, motors free where none holds."""

from itertools import pairwise
import math
import signal

import pytest
from std_srvs.srv import SetBool

from leo_msgs_py import topics

pytestmark = pytest.mark.graph


def test_goals_are_bounded_and_nothing_goes_back_to_one_of_before(robots):
    robot = robots('/servo', interface='position', robot='xl330_pendulum', realtime_factor=0)
    robot.ready()
    assert robot.step(0.5).values.tolist() == [0.5]
    assert robot.step(100.0).values.tolist() == [math.pi], 'clipped to the limit'
    for _ in range(30):
        robot.step(0.5)
    assert robot.states[-1].position[0] > 0.2

    stopped = robot.call(topics.E_STOP)
    assert stopped.success and 'motors free' in stopped.message
    robot.wait(lambda: robot.e_stopped[-1])
    assert robot.step(0.5).enabled.tolist() == [False]
    assert robot.call(topics.E_STOP_RESET).success
    robot.wait(lambda: not robot.e_stopped[-1])
    assert robot.step(0.5).nan_where_free.tolist() == [0.5]

    assert robot.call(topics.TORQUE, SetBool.Request(data=False)).success
    assert robot.step(0.5).enabled.tolist() == [False]
    assert robot.call(topics.TORQUE, SetBool.Request(data=True)).success
    assert robot.step(0.5).enabled.tolist() == [True]
    assert robot.stop(signal.SIGTERM) == 0
    assert 'Traceback' not in robot.said()


def test_in_real_time_a_goal_slews_from_where_the_joint_is_and_is_held(robots):
    robot = robots('/held', interface='position', robot='xl330_pendulum', slew=1.0)
    robot.ready()
    robot.wait(lambda: robot.applied and not robot.applied[-1].enabled.any(), 'not free')
    robot.wait(lambda: robot.send(0.4) or robot.obeyed(0.4), 'no goal')
    goals = [float(a.values[0]) for a in robot.applied if a.enabled.all()]
    steps = [b - a for a, b in pairwise(goals)]
    assert abs(goals[0]) < 0.1 and max(steps) < 0.1, 'it went there in one step'
    count = len(robot.applied)
    robot.wait(lambda: len(robot.applied) > count + 60)
    assert robot.applied[-1].nan_where_free.tolist() == [0.4], 'held after the time-out'
    assert robot.stop() == 0
    assert 'Traceback' not in robot.said()
