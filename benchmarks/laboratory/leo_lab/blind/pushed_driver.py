# SPDX-License-Identifier: Apache-2.0
"""The simulated robot of which somebody takes hold."""

from __future__ import annotations

from collections.abc import Sequence

from leo_lab.blind.pushes import Push, Pusher
from leo_sim.drivers.base import DriverOptions
from leo_sim.drivers.simulated import SimulatedDriver
from leo_sim.model import Model

SLICE = 1e-3
"""A push is held for so long [s]: a hand answers to where the joint is."""


class PushedDriver(SimulatedDriver):
    """As the simulated driver; the pushes are torques on the links that nobody is told."""

    def __init__(self, options: DriverOptions, pushes: Sequence[Push]) -> None:
        super().__init__(options)
        self._pusher = Pusher(Model(options.robot), pushes)

    def advance(self, seconds: float) -> float:
        """Integrate one state period with the values written last, and with the pushes."""
        begin = self._ticks / self.info.state_rate
        if not self._pusher.acts(begin, begin + seconds):
            return super().advance(seconds)
        count = max(1, round(seconds / SLICE))
        for i in range(count):
            state, length = self._state, seconds / count
            push = self._pusher.torque(begin + i * length, state.q, state.dq)
            self._state = self._model.step(state, self._input, length, self._on, push)
        self._ticks += 1
        self._measured = self._measure()
        return seconds
