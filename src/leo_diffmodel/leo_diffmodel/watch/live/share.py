# SPDX-License-Identifier: Apache-2.0
"""How much of the model's one-step error the difference model takes away."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
import tempfile
from typing import TYPE_CHECKING

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.difference.data import Transitions, transitions
from leo_sim.model import Model

if TYPE_CHECKING:
    from leo_diffmodel.difference.model import DifferenceModel

Array = np.ndarray


@dataclass(frozen=True)
class Share:
    """One-step errors in units of the spread of each state's change, rms over the states.

    Attributes:
        version, trained_on: of the difference model.
        without: error of the model alone.
        corrected: error with the difference model.
    """

    version: int
    trained_on: int
    without: float
    corrected: float

    @property
    def words(self) -> str:
        """The share in words."""
        taken = 1.0 - self.corrected / self.without if self.without else 0.0
        does = f'takes {taken:.0%} of' if taken >= 0 else f'adds {-taken:.0%} to'
        figures = f'{self.without:.3g} → {self.corrected:.3g} of the change'
        name = f'difference model {self.version}, trained on {self.trained_on} steps'
        return f'{name}: {does} the one-step error ({figures})'


class Sharer:
    """Reads the weights that the graph latched last, once each time they change."""

    def __init__(self, model: Model) -> None:
        self._model, self._bytes = model, b''
        self._difference: DifferenceModel | None = None
        self._base = model

    def share(self, weights: bytes, recording: Recording) -> Share | None:
        """The share on a recording; None before there are weights.

        Raises:
            UserError: the weights are none, or no step of the recording was driven.
        """
        if not weights:
            return None
        if weights != self._bytes:
            self._read(weights)
        difference = self._difference
        if difference is None or difference.robot != self._model.robot.name:
            return None
        alone = transitions([recording], self._model)
        based = alone if self._base is self._model else transitions([recording], self._base)
        corrected = difference.predict(based, self._base)
        before, after = _size(alone, alone.q_model, alone.dq_model), _size(alone, *corrected)
        return Share(difference.version, difference.trained_on, before, after)

    def _read(self, weights: bytes) -> None:
        from leo_diffmodel.difference.model import from_bytes

        self._bytes, self._difference = weights, None
        difference = from_bytes(weights)
        with tempfile.TemporaryDirectory() as folder:
            self._base = difference.model_beside(Path(folder, 'base.yaml'), self._model)
        self._difference = difference


def _size(steps: Transitions, q: Array, dq: Array) -> float:
    """The error of predicted states, each in units of how much the state changes."""
    off = np.hstack([steps.q_next - q, steps.dq_next - dq])
    change = np.hstack([steps.q_next - steps.q, steps.dq_next - steps.dq])
    size = np.sqrt((change**2).mean(axis=0)) + 1e-12
    return float(np.sqrt(((off / size) ** 2).mean()))
