# SPDX-License-Identifier: Apache-2.0
"""What is wrong with the log is asked before what is wrong with the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.faults.base import Found
from leo_diffmodel.faults.find import find_faults
from leo_diffmodel.faults.mending import all_mended, pooled
from leo_sim.model import Model


@dataclass(frozen=True)
class Logged:
    """Recordings as far as they can be believed.

    Attributes:
        recordings: to learn from, mended where that was asked for.
        hold_out: what no fit may see, mended alike.
        faults: what was found in all of them, errors first.
        mended: those that were undone.
    """

    recordings: Sequence[Recording]
    hold_out: Sequence[Recording]
    faults: tuple[Found, ...] = ()
    mended: tuple[Found, ...] = ()

    @classmethod
    def of(
        cls,
        recordings: Sequence[Recording],
        hold_out: Sequence[Recording],
        model: Model,
        mend: bool,
        by_torques: bool,
    ) -> Logged:
        """Look for faults, and undo those that are sure where `mend` says so.

        Args:
            recordings: to learn from.
            hold_out: what no fit may see.
            model: of their robot.
            mend: undo what is sure.
            by_torques: ask the balance of torques, too.
        """
        everything = [*recordings, *hold_out]
        each = find_faults(everything, model, by_torques)
        faults = pooled(each)
        undone = [f for f in faults if f.can_be_mended]
        if not mend or not undone:
            return cls(recordings, hold_out, tuple(faults))
        keys = {(f.fault.name, f.joint) for f in undone}
        mended = all_mended(everything, [f for f in each if (f.fault.name, f.joint) in keys])
        count = len(recordings)
        return cls(mended[:count], mended[count:], tuple(faults), tuple(undone))

    @property
    def in_the_way(self) -> list[Found]:
        """Sure faults that are still there."""
        return [f for f in self.faults if f.error and f not in self.mended]

    @property
    def answer(self) -> tuple[str, str]:
        """The sentence where a fault is in the way, and what to do about it."""
        what = '; '.join('; or '.join([f.what, *f.otherwise]) for f in self.in_the_way)
        todo = '; '.join(dict.fromkeys(_todo(f) for f in self.in_the_way))
        return f'The log is wrong, so no effect is named: {what}.', todo

    @property
    def headline(self) -> str:
        """What was mended, to stand before an answer; '' where nothing was."""
        if not self.mended:
            return ''
        done = '; '.join(f'{f.what}: {f.mending}' for f in self.mended)
        return f'After mending the log ({done}): '


def _todo(fault: Found) -> str:
    by_map = f'put "{fault.line}" into the topic map' if fault.line else ''
    todo = by_map or fault.fault.todo
    return f'{todo}, or --mend' if fault.can_be_mended else todo
