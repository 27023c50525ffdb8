# SPDX-License-Identifier: Apache-2.0
"""The running robot as `leo play` finds it: what it is, put into a pose, recorded meanwhile."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
import shlex
import sys
from typing import Any

import numpy as np
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter

from leo_diffmodel.bags.recorder import Recorder
from leo_diffmodel.next_run.reach import from_here
from leo_diffmodel.next_run.run_file import Run
from leo_diffmodel.nodes.graph_recorder import GraphRecorder
from leo_diffmodel.nodes.robot_facts import FACTS, facts_of, held_in
from leo_learner.robot.env import RobotEnv, Stopped
from leo_msgs_py import topics
from leo_msgs_py.errors import UserError
from leo_msgs_py.node import call, graph, join, listen, running, spin_once, spin_until
from leo_msgs_py.values import Applied
from leo_sim.description.robot import load_robot, Robot

FOUND_SECONDS = 10.0  # how long a robot is looked for
ANSWER_SECONDS = 60.0  # how long one that is there may take to answer: it may be starting up
PATIENCE = 5.0
SAID_SECONDS = 0.5  # within it a robot in real time says where its servos are held


class RunningRobot:
    def __init__(self, node: Node) -> None:
        self.node = node
        self.facts: dict[str, str] = {}  # what it says about itself, as bags say it; set by `ask`

    def ask(self) -> Robot:
        self.facts = self._facts(FACTS) or self._facts(FACTS[:1])
        if 'robot' not in self.facts:
            raise UserError('the node /robot does not say which robot it is (parameter robot)')
        return load_robot(self.facts['robot'])

    def put(self, pose: str) -> None:
        """Have it start in a pose from now on; UserError where it does not go there by itself."""
        if self.facts.get('start') == pose:
            return
        value = Parameter('start', value=pose).to_parameter_msg()
        request = SetParameters.Request(parameters=[value])
        (result,) = self._call(SetParameters, 'robot/set_parameters', request).results
        if not result.successful:
            raise UserError(
                f'the robot starts in {self.facts.get("start")!r}, this begins in {pose!r}, and '
                f'{result.reason}; put it there and start its node with '
                f'{shlex.join(["-p", f"start:={pose}"])}'
            )
        self.facts['start'] = pose
        self.facts |= held_in(self.facts)

    def wait(self) -> None:
        """Serve the graph for a moment; Stopped where the process was asked to end."""
        if not running():
            raise Stopped
        spin_once()

    def env(self, robot: Robot) -> RobotEnv:
        return RobotEnv(self.node, robot)

    @contextmanager
    def recorded(self, bag: Path | None) -> Iterator[None]:
        """Record the graph into a bag as long as this lasts; nothing without a bag."""
        if bag is None:
            yield
            return
        recorder = Recorder(bag)
        recorder.describe(self.facts)
        recording = GraphRecorder(self.node, recorder)
        recording.add_graph()
        try:
            yield
        except KeyboardInterrupt:
            print(f'stopped; {bag} holds what was done until then', file=sys.stderr)
            raise
        finally:
            recording.close()

    def _facts(self, names: tuple[str, ...]) -> dict[str, str]:
        request = GetParameters.Request(names=list(names))
        return facts_of(self._call(GetParameters, 'robot/get_parameters', request).values)

    def _call(self, kind: Any, name: str, request: Any) -> Any:
        client = self.node.create_client(kind, name)
        try:
            if not spin_until(client.service_is_ready, FOUND_SECONDS):
                raise UserError(
                    'no robot is running; start one (leo run leo_sim robot '
                    '--ros-args -p robot:=leo) or name a model (--model leo)'
                )
            return call(client, request, ANSWER_SECONDS)
        except TimeoutError as error:
            if not running():
                raise Stopped from error
            raise UserError(f'the robot does not answer: {error}') from error
        finally:
            self.node.destroy_client(client)


@contextmanager
def running_robot(ros_args: list[str], name: str = 'play') -> Iterator[RunningRobot]:
    with graph(ros_args):
        yield RunningRobot(join(Node(name)))


class RobotPlayer:
    """Plays runs on a robot node, in lockstep or in real time; its safety stays in force."""

    def __init__(self, node: Node, env: RobotEnv) -> None:
        self.env = env
        self._torque = node.create_client(*topics.TORQUE)
        self._held = np.full(len(env.robot.actuators), np.nan)
        self._goals_known = env.robot.input != 'position'
        if env.robot.input == 'position':
            listen(node, topics.APPLIED['position'], self._on_applied)

    def play(self, run: Run, on_step: Callable[[], None] = lambda: None) -> bool:
        """Send the run; motors are on at 0 in the end, come what may.

        It begins with a reset. Servos are taken to the first goal instead, from where they are.
        False where the robot was restarted meanwhile. UserError: the robot does not switch its
        motors off or on.
        """
        if not self._begun(run):
            return False
        on = True
        try:
            for inputs, wanted in zip(run.inputs, run.enabled, strict=True):
                if bool(wanted) != on:
                    on = bool(wanted)
                    self._switch(on)
                if 'lost' in self.env.step(inputs)[4]:
                    return False
                on_step()
            return True
        finally:
            if not on and running():
                self._switch(True)

    def goals(self) -> np.ndarray:
        """Where the servos are held [rad], (A,); those that are free, where they are."""
        spin_until(lambda: self._goals_known, SAID_SECONDS)
        angles = self.env.next_state().q[list(self.env.robot.actuated)]
        return np.where(np.isnan(self._held), angles, self._held)

    def _on_applied(self, message: Any) -> None:
        applied = Applied.from_message(message, 'position')
        actuators = [a.joint for a in self.env.robot.actuators]
        if set(applied.names) == set(actuators):
            order = [applied.names.index(joint) for joint in actuators]
            self._held, self._goals_known = applied.nan_where_free[order], True

    def _begun(self, run: Run) -> bool:
        """Bring the robot to where the run begins; False where it was restarted meanwhile."""
        if self.env.robot.input != 'position':
            self.env.reset()
            return True
        self.env.begin_here()
        whole = from_here(run, self.goals(), self.env.robot)
        lead = whole.inputs[: whole.count - run.count]
        return not any('lost' in self.env.step(goals)[4] for goals in lead)

    def _switch(self, on: bool) -> None:
        request = topics.TORQUE.type.Request(data=on)
        try:
            done = call(self._torque, request, PATIENCE).success
        except TimeoutError:
            done = False
        if not done:
            raise UserError(
                f'the robot does not switch its motors {"on" if on else "off"} '
                f'(/{topics.TORQUE.name}); choose a run without torque off'
            )
