# SPDX-License-Identifier: Apache-2.0
"""The robot node as a gymnasium environment: a command out, the state one period later in."""

from collections.abc import Callable
import time
from typing import Any

import numpy as np
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node

from leo_diffmodel.nodes.robot_facts import FACTS, facts_of
from leo_learner.environment.env import RobotSpaces, Step
from leo_learner.robot.states import RobotStates
from leo_msgs_py import topics
from leo_msgs_py.node import listen, running, spin_once
from leo_msgs_py.values import command_message, JointStates
from leo_sim.description.robot import refuse_other, Robot
from leo_sim.drivers.base import INTERFACES
from leo_sim.model import State
from leo_sim.task.task import observation

# Times in s.
SAME_START = 0.5  # after it a state equal to the one before the reset is taken for the start pose
RESEND = 0.3  # a robot that repeats its state this long after a command gets it again
SET_BACK = 1.0  # states older than the one before for so long: the robot's clock was set back
REMIND = 10.0  # between two lines that say what is waited for
FIRST_REMINDER = 2.0  # until the first of them
AGAIN = 0.5  # until a reset that the robot refuses is asked for again
ROBOT = 'the robot (leo run leo_sim robot)'


class Stopped(KeyboardInterrupt):
    """The process was asked to end while the environment waited for the robot."""


class RobotEnv(RobotSpaces):
    """Episodes on a running robot node, in lockstep or in real time.

    The robot's own parameter `start` decides on the start pose, whatever `reset` asks for. An
    episode during which the robot was restarted, or its clock set back, ends with
    `info['lost']`, and the last transition is none; until a robot answers, the environment
    waits, and its `node`, which has joined the graph, is served. States without the robot's
    joints, or that are not finite, are left out. UserError where the robot that runs says that
    it is another one, only other joints are heard of, or two robots speak at the same time.
    """

    def __init__(self, node: Node, robot: Robot) -> None:
        super().__init__(robot)
        self._node = node
        self._episode = -1
        self._state: JointStates | None = None
        self._period_ns = round(robot.control_period * 1e9)
        self._states = RobotStates(node, robot.joint_names)
        listen(node, topics.EPISODE, self._on_episode)
        # The robot wants the newest command, a recorder every one: so many are kept for it.
        kind, name, _ = topics.COMMANDS[INTERFACES[robot.input]]
        self._commands = node.create_publisher(kind, name, topics.DEEP)
        self._parameters = node.create_client(GetParameters, 'robot/get_parameters')
        self._reset = node.create_client(*topics.RESET)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        super().reset(seed=seed)
        self._state = None
        while self._state is None:
            self._found()
            self._state = self._after_reset()
        return self._begin(_state(self._state)), {}

    def begin_here(self) -> State:
        """Go on from where the robot is, without a reset: position servos hold it there."""
        begun = self.next_state()
        self._state = self._latest
        self._begin(begun)
        return begun

    def next_state(self) -> State:
        before = self._latest
        self._found()
        self._wait(lambda: self._latest is not before, ROBOT)
        assert self._latest is not None
        return _state(self._latest)

    def _found(self) -> None:
        self._wait(self._reset.service_is_ready, ROBOT)
        refuse_other(self._name_of_robot(), self.robot)
        self._wait(lambda: self._latest is not None and self._episode >= 0, ROBOT)
        self._wait(self._reset.service_is_ready, ROBOT)  # it may have gone meanwhile

    def _name_of_robot(self) -> str:
        if not self._parameters.service_is_ready():
            return ''
        answer = self._call(self._parameters, GetParameters.Request(names=FACTS[:1]), 'its name')
        return facts_of(answer.values).get('robot', '') if answer else ''

    def step(self, action: np.ndarray) -> Step:
        """Command `action` [V, N m or rad] and wait for the state one control period later."""
        assert self._state is not None, 'reset the environment first'
        before, episode = self._state, self._episode
        inputs = np.clip(np.asarray(action, float), -self.robot.limits, self.robot.limits)
        after = self._follow(before, inputs, episode)
        if after is None:
            seen = observation(self.robot, before.position, before.velocity)
            return seen, 0.0, False, True, {'lost': True}
        self._state = after
        return self._outcome(_state(before), inputs, _state(after))

    def _after_reset(self) -> JointStates | None:
        previous, episode, asked = self._latest, self._episode, time.monotonic()
        answer = self._call(self._reset, topics.RESET.type.Request(), 'the reset')
        if answer is None or not answer.success:
            if answer is not None:
                log = self._node.get_logger()
                log.info(f'waiting for a reset: {answer.message}', throttle_duration_sec=REMIND)
                self._wait(lambda: False, 'the start pose', limit=AGAIN)
            return None

        def arrived() -> bool:
            patient = time.monotonic() - asked > SAME_START
            return self._episode != episode and (patient or not _same(self._latest, previous))

        self._wait(arrived, 'the first state of an episode', limit=5.0)
        return self._latest if arrived() else None

    def _call(self, client: Any, request: Any, what: str) -> Any:
        future = client.call_async(request)
        return future.result() if self._wait(future.done, what, limit=5.0) else None

    def _follow(self, before: JointStates, inputs: np.ndarray, episode: int) -> JointStates | None:
        """Command until the state one period after `before` is there; None if it never comes."""
        due = before.stamp_ns + self._period_ns - self._period_ns // 100
        command = command_message(inputs)
        self._commands.publish(command)
        began = sent = time.monotonic()
        self._states.repeated = False

        def done() -> bool:
            nonlocal sent
            latest = self._latest
            assert latest is not None
            if self._states.repeated and time.monotonic() - sent > RESEND:
                self._commands.publish(command)
                sent, self._states.repeated = time.monotonic(), False
            lost = self._episode != episode or self._set_back(before, latest, began)
            return lost or latest.stamp_ns >= due

        self._wait(done, 'the next state')
        latest = self._latest
        there = latest is not None and latest.stamp_ns >= due and self._episode == episode
        return latest if there else None

    def _set_back(self, before: JointStates, latest: JointStates, began: float) -> bool:
        """Whether what came since `began` has been older than `before` for long; says so."""
        back = before.stamp - latest.stamp
        if back <= 0.0 or time.monotonic() - began < SET_BACK:
            return False
        self._node.get_logger().warning(
            f"the stamps of the robot's states fell back by {back:g} s: this episode ends"
        )
        return True

    def _wait(self, ready: Callable[[], bool], what: str, limit: float | None = None) -> bool:
        """Spin until `ready`; False after `limit` seconds, without one a reminder now and then."""
        began = time.monotonic()
        reminded = began - REMIND + FIRST_REMINDER
        while not ready():
            if not running():
                raise Stopped
            self._states.check()
            spin_once()
            now = time.monotonic()
            if limit is not None and now - began > limit:
                return False
            if now - reminded > REMIND:
                reminded = now
                self._remind(what, now - began)
        return True

    def _remind(self, what: str, waited: float) -> None:
        unusable = self._states.unusable
        if unusable and self._latest is None and waited > REMIND:
            raise unusable
        why = f'; {unusable}' if unusable else ''
        self._node.get_logger().info(f'waiting for {what}{why}')

    @property
    def _latest(self) -> JointStates | None:
        return self._states.latest

    def _on_episode(self, message: Any) -> None:
        self._episode = message.data


def _state(measured: JointStates) -> State:
    return State(measured.position, measured.velocity, {})


def _same(a: JointStates | None, b: JointStates | None) -> bool:
    if a is None or b is None:
        return a is b
    values = zip((a.position, a.velocity), (b.position, b.velocity), strict=True)
    return a.stamp_ns == b.stamp_ns and all(np.array_equal(x, y) for x, y in values)
