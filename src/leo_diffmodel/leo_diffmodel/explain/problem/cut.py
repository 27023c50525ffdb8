# SPDX-License-Identifier: Apache-2.0
"""What in the recordings is not the robot is left out, and said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.windows import thin
from leo_diffmodel.explain.settings import Settings
from leo_diffmodel.outside.outside import (
    LEFT_OUT,
    moved_from_outside,
    share_outside,
    Stretch,
    without,
)
from leo_sim.model import Model


@dataclass(frozen=True)
class Cut:
    """Recordings less the stretches in which something else moved the robot.

    Attributes:
        recordings: what to learn from.
        hold_out: what no fit may see.
        settings: how many stretches are listed.
        stretches: what was left out, in the numbering of all recordings as given.
        share: of the moving time that is in them, 0 to 1.
    """

    recordings: Sequence[Recording]
    hold_out: Sequence[Recording]
    settings: Settings
    stretches: tuple[Stretch, ...] = ()
    share: float = 0.0

    @classmethod
    def of(
        cls,
        recordings: Sequence[Recording],
        hold_out: Sequence[Recording],
        settings: Settings,
        model: Model,
        as_given: bool = False,
    ) -> Cut:
        """Find the stretches and cut them out, or leave all as it is."""
        if as_given:
            return cls(recordings, hold_out, settings)
        everything = [*recordings, *hold_out]
        found = [s for s in moved_from_outside(everything, model) if s.kind in LEFT_OUT]
        mine = [s for s in found if s.source < len(recordings)]
        later = [replace(s, source=s.source - len(recordings)) for s in found if s not in mine]
        kept = without(recordings, mine) if mine else recordings
        held = without(hold_out, later) if later else hold_out
        return cls(kept, held, settings, tuple(found), share_outside(everything, found))

    @property
    def thinned(self) -> tuple[list[Recording], list[Recording]]:
        """Both at a common rate that still shows every effect."""
        data = thin([*self.recordings, *self.hold_out])
        return data[: len(self.recordings)], data[len(self.recordings) :]

    @property
    def notes(self) -> list[str]:
        """What was left out, in words; empty where nothing was."""
        if not self.stretches:
            return []
        return [f'left out as moved or held from outside, --keep uses it: {self._listed}']

    @property
    def answer(self) -> tuple[str, str]:
        """The sentence where most of the motion is from outside, and what to record instead."""
        sentence = (
            f'Moved from outside in {self.share:.0%} of the moving time, so no effect is named: '
            f'{self._listed}.'
        )
        return sentence, 'record the robot alone, moved by its motors or by its weight'

    @property
    def _listed(self) -> str:
        words = [f'{max(0.0, s.begin):.1f} to {s.end:.1f} s ({s.why})' for s in self.stretches]
        listed = self.settings.numerics.listed
        more = len(words) - listed
        return ', '.join(words[:listed]) + (f' and {more} more' if more > 0 else '')
