# SPDX-License-Identifier: Apache-2.0
"""The states of one robot, picked out of what is published on the topic of joint states."""

import time
from typing import Any

import numpy as np
from rclpy.node import Node

from leo_msgs_py import topics
from leo_msgs_py.errors import UserError
from leo_msgs_py.node import listen_with_info, spin_until
from leo_msgs_py.values import JointStates
from leo_sim.nodes.commander import names_of, Turns

SAY = 10.0  # between two lines that say what is left out [s]
NAMED = 2.0  # how long the graph is given to name publishers it has just met [s]
NAMELESS = '_NODE_NAME_UNKNOWN_'


class RobotStates:
    """Listens to the joints of a robot.

    Messages of other joints (a gripper's) are none of the robot's; those of its joints that have
    another length, or values that are not finite, are left out, counted and said.
    """

    def __init__(self, node: Node, joints: tuple[str, ...]) -> None:
        self._node, self._joints = node, joints
        self._turns = Turns()
        self._topic = listen_with_info(node, topics.JOINT_STATES, self._on_message).topic_name
        self.latest: JointStates | None = None  # the newest state, in the robot's order
        self.repeated = False  # whether a state came twice; whoever sets it to False asks again
        self.unusable: UserError | None = None  # why the newest message is no state of the robot
        self.left_out = 0  # how many states of its joints were of no use
        self._two = False

    def check(self) -> None:
        """Raise UserError once two robots have published the states of these joints in turns."""
        if not self._two:
            return
        spin_until(lambda: not any(NAMELESS in name for name in self._publishers()), NAMED)
        raise UserError(
            f'two robots publish the states of the same joints on {self._topic} '
            f'({", ".join(self._publishers())}); give each a namespace (-r __ns:=/left) or a '
            'ROS_DOMAIN_ID of its own'
        )

    def _on_message(self, message: Any, info: dict[str, Any]) -> None:
        try:
            measured = self._measured(message)
        except UserError as error:
            self._leave_out(message, error)
            return
        self._two |= self._turns.taken(info['publication_sequence_number'], time.monotonic())
        self.repeated |= self.latest is not None and self.latest.stamp_ns == measured.stamp_ns
        self.latest, self.unusable = measured, None

    def _measured(self, message: Any) -> JointStates:
        measured = JointStates.from_message(message).of(self._joints)
        if not np.isfinite([measured.position, measured.velocity]).all():
            joints = ', '.join(self._joints)
            raise UserError(f'a joint state of {joints} has values that are not finite')
        return measured

    def _leave_out(self, message: Any, error: UserError) -> None:
        self.unusable = error
        if set(self._joints) <= set(message.name):
            self.left_out += 1
            self._node.get_logger().warning(
                f'{error}: left out, {self.left_out} so far', throttle_duration_sec=SAY
            )

    def _publishers(self) -> list[str]:
        return sorted(names_of(self._node.get_publishers_info_by_topic(self._topic)).elements())
