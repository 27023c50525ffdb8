# SPDX-License-Identifier: Apache-2.0
"""The difference model on the graph: queries, weights, updates. Composed into `diffmodel`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
import time
from typing import Any, TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticStatus
import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import UInt8MultiArray

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.difference.job import CONFIG_NAMES, Progress, Updates
from leo_msgs_py import topics
from leo_msgs_py.errors import UserError
from leo_msgs_py.node import every, listen
from leo_msgs_py.values import JointStates, status_message
from leo_sim.common.consent import effect_files
from leo_sim.model import Model
from leo_sim.model.model_file import load_model

if TYPE_CHECKING:
    from leo_diffmodel.difference.model import DifferenceModel

POLL_PERIOD = 0.2  # how often the fit's progress is read [s]
JUST_NOW = 4.0
"""Less than a client waits before it asks again [s]: its weights may still be on their way."""


@dataclass(frozen=True)
class Settings:
    model: str  # model file or robot name the difference is taken from
    bags: Callable[[], Sequence[Path]]  # folders of what was recorded so far, the open one too
    folder: Path  # where the weights are kept; found again after a restart
    config: str = 'recommended'  # of `CONFIG_NAMES`
    repair: bool = False  # name effects in the model before the network is fitted


class DifferenceService:
    """Answers queries, publishes weights, starts updates; recording never waits for it."""

    def __init__(self, node: Node, settings: Settings) -> None:
        if settings.config not in CONFIG_NAMES:
            names = ', '.join(CONFIG_NAMES)
            raise UserError(f'no difference model {settings.config!r}; give one of {names}')
        self._node, self._settings = node, settings
        self._model: Model = load_model(settings.model)
        given = settings.folder, settings.model, settings.config, settings.repair
        self._updates = Updates(*given, effect_files(self._model.effects))
        self._corrected = self._model
        self._difference: DifferenceModel | None = None
        self._fitted_at = float('-inf')
        self._corrections = node.create_publisher(*topics.DIFFERENCE_CORRECTION)
        self._weights = node.create_publisher(*topics.DIFFERENCE_WEIGHTS)
        listen(node, topics.DIFFERENCE_QUERY, self._on_query)
        node.create_service(*topics.DIFFERENCE_UPDATE, self._on_update)
        every(node, POLL_PERIOD, self._poll)
        self._publish_newest()

    def status(self) -> DiagnosticStatus:
        progress, difference = self._updates.progress, self._difference
        values = {
            'version': difference.version if difference else 0,
            'trained on': difference.trained_on if difference else 0,
            **progress.numbers,
        }
        name = f'{self._node.get_name()}: difference model'
        level = DiagnosticStatus.ERROR if progress.error else DiagnosticStatus.OK
        said = {key: f'{value:g}' for key, value in values.items()}
        return status_message(name, level, progress.error or progress.state, said)

    def close(self) -> None:
        self._updates.stop()

    def _on_update(self, _request: Any, response: Any) -> Any:
        response.success, response.message = self._begin()
        return response

    def _begin(self) -> tuple[bool, str]:
        """Whether an update has begun, and what to answer."""
        if self._updates.busy:
            return False, 'busy: an update is under way'
        if time.monotonic() - self._fitted_at < JUST_NOW:
            return False, 'an update has just ended'
        failed = self._updates.progress.error
        try:
            self._updates.begin(self._settings.bags())
        except UserError as error:
            self._updates.progress = Progress('failed', error=str(error))
            return False, str(error)
        again = f'; the last one failed: {failed}' if failed else ''
        return True, f'accepted: progress on /diagnostics{again}'

    def _poll(self) -> None:
        if not self._updates.poll():
            return
        if self._updates.progress.state == 'failed':
            self._node.get_logger().error(f'update failed: {self._updates.progress.error}')
        else:
            self._publish_newest()
            self._fitted_at = time.monotonic()

    def _publish_newest(self) -> None:
        kept = self._updates.kept()
        if not kept:
            return
        from leo_diffmodel.difference.model import first_whole

        found = first_whole(kept.values(), self._fail)
        if found is None:
            return
        data, difference = found
        try:
            beside = Path(difference.source).with_suffix('.yaml')
            corrected = difference.model_beside(beside, self._model)
        except UserError as error:
            self._fail(str(error))
            return
        self._difference, self._corrected = difference, corrected
        self._weights.publish(UInt8MultiArray(data=data))
        self._node.get_logger().info(
            f'difference model version {difference.version}, fitted to '
            f'{difference.trained_on} transitions, on /difference_model/weights'
        )

    def _fail(self, why: str) -> None:
        self._updates.progress = Progress('failed', error=why)
        self._node.get_logger().error(why)

    def _on_query(self, message: Any) -> None:
        try:
            asked = read_query(message, self._model)
        except UserError as error:
            self._node.get_logger().error(str(error), throttle_duration_sec=1.0)
            return
        q_wanted, dq_wanted = self._answer(*asked)
        names = list(self._model.robot.joint_names)
        wanted = {'position': q_wanted.tolist(), 'velocity': dq_wanted.tolist()}
        self._corrections.publish(JointState(header=message.header, name=names, **wanted))

    def _answer(self, q: Array, dq: Array, inputs: Array) -> tuple[Array, Array]:
        """What is to be added, (J,) each; nothing to a state that no step begins from."""
        if self._difference is not None:
            try:
                return correction(self._model, self._corrected, self._difference, q, dq, inputs)
            except UserError as error:
                self._node.get_logger().error(str(error), throttle_duration_sec=1.0)
        return np.zeros_like(q), np.zeros_like(dq)


def correction(
    model: Model, corrected: Model, difference: DifferenceModel, q: Array, dq: Array, inputs: Array
) -> tuple[Array, Array]:
    """What is to be added to the next angles [rad] and rates [rad/s] of `model`, both (J,).

    `corrected` is the model that `difference` goes on top of: the same, or a repaired one. State
    (J,) and held inputs [V, N m or rad], (A,). Where they lead to no finite state it is 0.
    UserError: a state that no step begins from.
    """
    with np.errstate(all='ignore'):
        following = model.step(model.state_from(q, dq), inputs, model.robot.control_period)
        state = corrected.state_from(q, dq)
        wanted = difference.applied(corrected, state, inputs, difference(q, dq, inputs))
        found = wanted.q - following.q, wanted.dq - following.dq
    return found if np.isfinite(found).all() else (np.zeros_like(q), np.zeros_like(dq))


def read_query(message: JointState, model: Model) -> tuple[Array, Array, Array]:
    """Angles and rates (J,) and inputs (A,) of a query; UserError where one is missing."""
    robot = model.robot
    asked = JointStates.from_message(message).of(robot.joint_names)
    if asked.effort is None:
        raise UserError(
            f'a difference query for {robot.name} gives position and velocity of '
            f'{", ".join(robot.joint_names)} and in effort the input [{robot.input_unit}] of '
            f'{", ".join(actuator.joint for actuator in robot.actuators)}'
        )
    return asked.position, asked.velocity, asked.effort[list(robot.actuated)]
