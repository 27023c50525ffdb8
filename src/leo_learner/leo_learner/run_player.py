# SPDX-License-Identifier: Apache-2.0
"""Send a run file to the robot, one control period after the other."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node

from leo_diffmodel.next_run.proposed_run import Run
from leo_learner.robot_env import RobotEnv
from leo_msgs_py import topics
from leo_msgs_py.errors import UserError
from leo_msgs_py.node import call, running

PATIENCE = 5.0
Tell = Callable[[], None]


class RobotPlayer:
    """Plays runs on a robot node, in lockstep or in real time; the node's safety stays in force.

    Args:
        node: joined to the graph.
        env: the same robot as an environment, which knows how to wait for it.
    """

    def __init__(self, node: Node, env: RobotEnv) -> None:
        self._env = env
        self._torque = node.create_client(*topics.TORQUE)

    def play(self, run: Run, tell: Tell = lambda: None) -> bool:
        """Reset the robot, then send the run; motors are on at 0 in the end, come what may.

        Returns:
            whether all of it was played: False where the robot was restarted meanwhile.

        Raises:
            UserError: the robot does not switch its motors off or on.
        """
        self._env.reset()
        on = True
        try:
            for inputs, wanted in zip(run.inputs, run.enabled, strict=True):
                if bool(wanted) != on:
                    on = bool(wanted)
                    self._switch(on)
                if 'lost' in self._env.step(inputs)[4]:
                    return False
                tell()
            return True
        finally:
            if not on and running():
                self._switch(True)

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
