# SPDX-License-Identifier: Apache-2.0
"""What of the recordings is used: right logs, and stretches in which the robot moved alone.

What is wrong with the log is asked before what is wrong with the robot.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.windows import thin
from leo_diffmodel.explain.settings import Settings
from leo_diffmodel.explain.told import Thing, Told
from leo_diffmodel.faults.find import find_faults
from leo_diffmodel.faults.found import Found
from leo_diffmodel.faults.mending import all_mended, pooled, which
from leo_diffmodel.faults.settings import LIMITS
from leo_diffmodel.outside.finding import Finding, WARNING
from leo_diffmodel.outside.outside import moved_from_outside, share_outside, without
from leo_sim.model import Model

ALONE = 'record the robot alone, moved by its motors or by its weight'
COLUMNS = 'look at columns, units and signs of the inputs'


@dataclass(frozen=True)
class Logged:
    """Recordings as far as they can be believed."""

    recordings: Sequence[Recording]  # to learn from, mended where that was asked for
    hold_out: Sequence[Recording]  # what no fit may see, mended alike
    each: tuple[Found, ...] = ()  # what was found in each of them
    faults: tuple[Found, ...] = ()  # the same in all of them, errors first
    mended: tuple[Found, ...] = ()  # those that were undone

    @classmethod
    def of(
        cls,
        recordings: Sequence[Recording],
        hold_out: Sequence[Recording],
        model: Model,
        mend: bool,
        by_torques: bool,
    ) -> 'Logged':
        """Look for faults, `by_torques` in their balance too, and `mend` those that are sure."""
        each = find_faults([*recordings, *hold_out], model, by_torques)
        log = cls(recordings, hold_out, tuple(each), tuple(pooled(each)))
        return log.without(log.in_the_way) if mend else log

    @property
    def in_the_way(self) -> list[Found]:
        return [f for f in self.faults if f.error and f not in self.mended]

    @property
    def decided(self) -> bool:
        return any(f.gained > LIMITS.decided for f in self.in_the_way)

    def without(self, faults: Sequence[Found]) -> 'Logged':
        """The recordings without those faults that can be undone; itself where none can."""
        undone = [f for f in faults if f.can_be_mended]
        if not undone:
            return self
        keys, everything = {which(f) for f in undone}, [*self.recordings, *self.hold_out]
        data = all_mended(everything, [f for f in self.each if which(f) in keys])
        count = len(self.recordings)
        return replace(
            self, recordings=data[:count], hold_out=data[count:], mended=(*self.mended, *undone)
        )

    @property
    def doubted(self) -> 'Logged':
        """With faults that may be there, and are not sure, where known effects do as well."""
        sure = self.in_the_way
        return replace(
            self,
            faults=tuple(replace(f, severity=WARNING) if f in sure else f for f in self.faults),
        )

    @property
    def answer(self) -> tuple[Told, str]:
        """What is said where a fault is in the way, and what to do about it."""
        what = tuple(Thing(f.in_words) for f in self.in_the_way)
        todo = '; '.join(dict.fromkeys(_todo(f) for f in self.in_the_way))
        return Told('The log is wrong, so no effect is named', what), todo

    @property
    def notes(self) -> list[str]:
        """What may be wrong with the log by the torques, and is not sure; the physics goes on."""
        return [
            f'the log may be wrong instead: {f.in_words}{_how_sure(f)}'
            for f in self.faults
            if f.evidence == 'balance' and not f.error
        ]

    @property
    def headline(self) -> str:
        """What was mended, to stand before an answer; '' where nothing was."""
        if not self.mended:
            return ''
        done = '; '.join(f'{f.what}: {f.mending}' for f in self.mended)
        return f'After mending the log ({done}): '


def _how_sure(fault: Found) -> str:
    if fault.gained == math.inf:
        return ''
    return (
        f' (predicts what was left out better than friction and masses that are off, by '
        f'{fault.gained:.1f} standard errors)'
    )


def _todo(fault: Found) -> str:
    by_map = f'put "{fault.line}" into the topic map' if fault.line else ''
    todo = by_map or fault.fault.todo
    return f'{todo}, or --mend' if fault.can_be_mended else todo


@dataclass(frozen=True)
class Cut:
    """Recordings without the stretches in which something else moved the robot."""

    recordings: Sequence[Recording]  # what to learn from
    hold_out: Sequence[Recording]  # what no fit may see
    settings: Settings  # how many stretches are listed, and what share of them is most
    # what was left out of each of all recordings; empty where nothing was
    stretches: tuple[list[Finding], ...] = ()
    share: float = 0.0  # of the moving time that is in them, 0 to 1

    @classmethod
    def of(
        cls,
        recordings: Sequence[Recording],
        hold_out: Sequence[Recording],
        settings: Settings,
        model: Model,
        as_given: bool = False,
    ) -> 'Cut':
        if as_given:
            return cls(recordings, hold_out, settings)
        everything = [*recordings, *hold_out]
        found = tuple(moved_from_outside(r, model) for r in everything)
        if not any(found):
            return cls(recordings, hold_out, settings)
        kept = without(recordings, found[: len(recordings)])
        held = without(hold_out, found[len(recordings) :])
        return cls(kept, held, settings, found, share_outside(everything, found))

    @property
    def mostly(self) -> bool:
        return self.share > self.settings.gates.outside

    @property
    def thinned(self) -> tuple[list[Recording], list[Recording]]:
        """Both at a common rate that still shows every effect."""
        data = thin([*self.recordings, *self.hold_out])
        return data[: len(self.recordings)], data[len(self.recordings) :]

    @property
    def notes(self) -> list[str]:
        if not self.stretches:
            return []
        return [f'left out as moved or held from outside, --keep uses it: {self._listed}']

    @property
    def answer(self) -> tuple[Told, str]:
        """What is said where most of the motion is from outside, and what to record instead."""
        unlike = all(f.code == 'unexplained' for each in self.stretches for f in each)
        what = 'Unlike all that is known' if unlike else 'Moved from outside'
        share = f'in {self.share:.0%} of the moving time, so no effect is named'
        return Told(f'{what} {share}', (Thing(self._listed),)), COLUMNS if unlike else ALONE

    @property
    def _listed(self) -> str:
        words = [
            f'{max(0.0, begin):.1f} to {end:.1f} s ({f.what})'
            for each in self.stretches
            for f in each
            for begin, end in f.where
        ]
        listed = self.settings.numerics.listed
        more = len(words) - listed
        return ', '.join(words[:listed]) + (f' and {more} more' if more > 0 else '')
