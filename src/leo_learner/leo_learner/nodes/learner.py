# SPDX-License-Identifier: Apache-2.0
"""The learner node: Algorithm 5 over the topics of a robot and a difference-model node.

leo run leo_sim robot --ros-args -p robot:=pendulum -p realtime_factor:=0 -p start:=random
leo run leo_diffmodel diffmodel --ros-args -p model:=pendulum -p bag:=runs/a5/rollout
leo run leo_learner learner --ros-args -p model:=pendulum -p folder:=runs/a5
"""

from dataclasses import asdict
import json
from pathlib import Path
import shlex
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node
from std_msgs.msg import Header

from leo_diffmodel.difference.fit import LEAST as LEAST_TRANSITIONS
from leo_diffmodel.difference.job import NOT_BETTER
from leo_diffmodel.difference.model import from_bytes
from leo_learner.algorithm5 import Algorithm5, Done, Settings
from leo_learner.ddpg.configs import Config, configuration
from leo_learner.learning.checkpoint import newest
from leo_learner.learning.policy import Policy
from leo_learner.learning.run import POLICY
from leo_learner.robot.env import RobotEnv, Stopped
from leo_msgs_py import node as nodes
from leo_msgs_py import topics
from leo_msgs_py.cli import executable
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.values import status_message
from leo_sim.common.consent import trust_parameter
from leo_sim.description.robot import Robot
from leo_sim.model import Model
from leo_sim.model.model_file import load_model

LEAST = {'tests': 1, 'patience': 1, 'transitions': LEAST_TRANSITIONS}
"""Of the settings that may not be 0."""
PERIOD = 1.0  # between two reports [s]; while a policy trains, the episode under way ends first
ASK_AGAIN = 5.0  # until an update is asked for again [s]: the node may have been restarted


def read_settings(node: Node) -> Settings:
    defaults = {name: v for name, v in asdict(Settings()).items() if not isinstance(v, bool)}
    given = {name: nodes.fixed_parameter(node, name, value) for name, value in defaults.items()}
    for name, value in given.items():
        least = LEAST.get(name, 0)
        if not isinstance(value, int) or value < least:
            raise UserError(f'{name} is {value!r}; give a whole number, {least} or more')
    return Settings(**given)


def checked(start: str, robot: Robot, config: Config) -> Path | None:
    """The folder of the run that takes the place of the first training.

    UserError: it has no checkpoint, or one that a training of `config` cannot go on with.
    """
    if not start:
        return None
    newest(Path(start))
    policy = Policy.load(Path(start) / POLICY)
    policy.check(robot)
    if policy.actions != 'full':
        raise UserError(
            f'{start}: a policy on which DDPG on all actuators cannot go on; give a '
            f'run of {leo("learn", "--robot", robot.name)}'
        )
    if json.loads(policy.metadata['config']) != json.loads(json.dumps(asdict(config))):
        raise UserError(
            f'{start} was trained with another configuration; give the config it had '
            '(-p config:=recommended or thesis)'
        )
    return Path(start)


class Status:
    """Logs what is being done, and repeats it on /diagnostics once a second."""

    def __init__(self, node: Node) -> None:
        self._node, self._said = node, 'starting'
        self.done: Done | None = None
        self._publisher = node.create_publisher(*topics.DIAGNOSTICS)
        nodes.every(node, PERIOD, self._report)

    def say(self, text: str) -> None:
        self._said = text
        self._node.get_logger().info(text)

    def _report(self) -> None:
        header = Header(stamp=self._node.get_clock().now().to_msg())
        name = f'{self._node.get_name()}: learning'
        status = status_message(name, DiagnosticStatus.OK, self._said, self._values())
        self._publisher.publish(DiagnosticArray(header=header, status=[status]))

    def _values(self) -> dict[str, object]:
        if self.done is None:
            return {}
        returns = ', '.join(f'{r:.1f}' for r in self.done.tests)
        return {
            'round': self.done.update,
            'phase': self.done.phase,
            'difference model version': self.done.version,
            'returns on the robot': returns or 'none yet',
            'round that drives the robot': self.done.driver,
            'steps on the robot': self.done.samples,
        }


@executable
def main(argv: list[str]) -> int:
    with nodes.graph(argv):
        node = Node('learner')
        status = Status(node)
        algorithm = _algorithm(node, status)
        typed = shlex.join(['-p', f'folder:={algorithm.folder}'])
        again = f'start again with {typed} to go on'
        try:
            if algorithm.run():
                status.say(
                    f'done; best policy {algorithm.best}, after {algorithm.done.samples} '
                    f'steps on the robot; try: {leo("play", algorithm.best)}'
                )
            else:
                status.say(f'stopped; {again}')
        except Stopped:
            status.say(f'stopped while waiting; {again}')
    return 0


def _algorithm(node: Node, status: Status) -> Algorithm5:
    settings = read_settings(node)
    trust_parameter(nodes.private_parameter(node, 'effect', ['']))
    model = load_model(nodes.fixed_parameter(node, 'model', 'pendulum'))
    folder = Path(nodes.fixed_parameter(node, 'folder', 'runs/learner'))
    start = nodes.fixed_parameter(node, 'start', '')
    name = nodes.fixed_parameter(node, 'config', 'recommended')
    config = configuration(name, model.robot)
    nodes.join(node)
    algorithm = Algorithm5(
        folder,
        model,
        config,
        Settings(**asdict(settings) | {'thesis': name == 'thesis'}),
        RobotEnv(node, model.robot),
        DifferenceClient(node, model),
        _alive,
        status.say,
        checked(start, model.robot, config),
    )
    status.done = algorithm.done
    return algorithm


def _alive() -> bool:
    nodes.spin_once(0.0)
    return nodes.running()


class DifferenceClient:
    """Waits for weights of a later version that go with a model, asking until it gets them."""

    def __init__(self, node: Node, model: Model) -> None:
        self._node, self._model = node, model
        self._weights, self._said = b'', ''
        self._version = 0
        self._accepted, self._failure = False, ''
        nodes.listen(node, topics.DIFFERENCE_WEIGHTS, self._on_weights)
        self._update = node.create_client(*topics.DIFFERENCE_UPDATE)

    def newer(self, version: int) -> bytes:
        """Weights of a later version than `version`, fitted after this call.

        Raises:
            Stopped: the process was asked to end.
            UserError: an update has come to nothing better than the model.
        """
        version = max(version, self._version)
        asked = -ASK_AGAIN
        self._accepted, self._failure = False, ''
        while self._version <= version:
            if not nodes.running():
                raise Stopped
            if self._failure:
                raise UserError(f'{self._failure}; the policies learned so far stay')
            if time.monotonic() - asked > ASK_AGAIN:
                asked = time.monotonic()
                self._ask()
            nodes.spin_once()
        return self._weights

    def _ask(self) -> None:
        if self._update.service_is_ready():
            future = self._update.call_async(topics.DIFFERENCE_UPDATE.type.Request())
            future.add_done_callback(self._on_answer)
        else:
            self._log('waiting for the difference model (leo run leo_diffmodel diffmodel)')

    def _on_answer(self, future: Any) -> None:
        answer = future.result()
        self._log(f'difference model: {answer.message}')
        if self._accepted and NOT_BETTER in answer.message:  # of the update this call has begun
            self._failure = answer.message
        self._accepted = self._accepted or answer.success

    def _log(self, text: str) -> None:
        if text != self._said:
            self._node.get_logger().info(text)
        self._said = text

    def _on_weights(self, message: Any) -> None:
        data = bytes(message.data)
        try:
            difference = from_bytes(data, topics.DIFFERENCE_WEIGHTS.name)
            difference.beneath(self._model)
        except UserError as error:
            self._node.get_logger().error(f'weights ignored: {error}')
            return
        self._weights, self._version = data, difference.version
