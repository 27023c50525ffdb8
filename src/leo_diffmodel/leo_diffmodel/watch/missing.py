# SPDX-License-Identifier: Apache-2.0
"""The torque that the models lack, and where: as given, with the switches, and as they say."""

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from leo_diffmodel.compare import torque as torques
from leo_diffmodel.compare.noise import HISTORY
from leo_diffmodel.compare.where import Where, where
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.watch.scene import Scene
from leo_sim.model import Model

AT_ONCE, ON_GROUND_AT_ONCE = 1000, 200
"""Windows that are estimated in one go, over the joints; of a robot on the ground."""


@dataclass(frozen=True)
class Missing:
    """The torque that one model lacks, window by window, and by joint and condition."""

    torque: torques.MissingTorque
    places: Where


class MissingOfBoth:
    """What the model as given lacks, and with the switches; takes long, and follows them."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.given: Missing | None = None  # of the model as given; None before it is known
        self.now: Missing | None = None  # of that with the switches, in the same way
        self.curve: np.ndarray | None = None
        """What the model as given would lack if that with the switches were the robot [N m],
        shape (W, J), in the windows of `given`; None where nothing is on."""
        self.behind = True  # all of it is still of switches as they were before
        self.trouble = ''  # why there is none of it; '' where there is

    def follow(self, model: Model | None) -> Iterator[bool]:
        """Compute all for a model with switches, if any is on, with pauses: True for news."""
        self.trouble = ''
        try:
            yield from self._follow(model)
        except (ValueError, np.linalg.LinAlgError) as error:
            self.trouble = f'torque over short windows cannot be estimated here: {error}'
        self.behind = False
        yield True

    def _follow(self, model: Model | None) -> Iterator[bool]:
        given, sigma = self._scene.model, self._scene.sigma
        if self.given is None:
            self.given = yield from self._missing_of(given)
            yield True
        if model is None:
            self.now, self.curve = self.given, None
            return
        work = partial(torques.supposed, given, model, sigma=sigma)
        self.curve = (yield from self._in_parts(work, self.given.torque.windows)).torque
        yield True
        self.now = yield from self._missing_of(model)

    def _missing_of(self, model: Model) -> Generator[bool, None, Missing]:
        windows = torques.torque_windows(self._scene.recordings, model, HISTORY)
        work = partial(torques.estimate, model, sigma=self._scene.sigma)
        missing = torques.trusted((yield from self._in_parts(work, windows)), model)
        yield False
        return Missing(missing, where(missing, model))

    def _in_parts(
        self, work: Callable[[Windows], torques.MissingTorque], windows: Windows
    ) -> Generator[bool, None, torques.MissingTorque]:
        robot = self._scene.model.robot
        most = ON_GROUND_AT_ONCE if robot.contacts else AT_ONCE
        return torques.in_parts(work, windows, max(1, most // len(robot.joint_names)))
