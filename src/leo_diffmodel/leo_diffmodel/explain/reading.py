# SPDX-License-Identifier: Apache-2.0
"""The search in a reading of the log: as it is, or without what its torques say is wrong with it.

A fault that torques show is judged beside all effects: each reading has its own search, and what
predicts the motion that neither was fitted to is the answer.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import zip_longest
import time

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.findings.held_out import HeldOut
from leo_diffmodel.explain.problem.candidates import own_constants
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.problem.pose import pose, Posed, refined, untestable
from leo_diffmodel.explain.problem.usable import Cut, Logged
from leo_diffmodel.explain.select.search import Search, search
from leo_diffmodel.explain.settings import Settings
from leo_diffmodel.faults.left_out import better
from leo_diffmodel.faults.settings import LIMITS
from leo_msgs_py.console import Reporter
from leo_sim.effects import Effect
from leo_sim.model import Model


@dataclass(frozen=True)
class Asked:
    model: Model
    settings: Settings
    progress: Reporter
    extra: Sequence[Effect] = ()  # a user's own effects
    as_given: bool = False  # take the log, and what may have been moved from outside, as it is
    hear: 'Callable[[Reading, Estimate, Estimate], None]' = lambda *_: None  # each better set

    @property
    def silently(self) -> 'Asked':
        """What is asked, by a search that tells nobody of better sets on its way."""
        return Asked(self.model, self.settings, self.progress, self.extra, self.as_given)


@dataclass(frozen=True)
class Reading:
    """What a search found in one reading of the log."""

    asked: Asked
    log: Logged
    cut: Cut  # its recordings, without what moved them from outside
    recordings: tuple[Recording, ...]  # thinned, as the search had them, held-out ones last
    facts: Facts
    search: Search | str  # or why these data cannot test the model

    @property
    def leaves_noise(self) -> bool:
        return not isinstance(self.search, str) and self.search.leaves_noise

    def held_out(self, posed: Posed, fitted: Fit) -> HeldOut:
        own = own_constants(self.asked.model, self.cut.hold_out)
        return HeldOut.of(self.recordings, posed, fitted, self.asked.model, own)

    def missed(self, sigma: Array) -> Array:
        """Mean size of the errors in each held-out block of time, in noise (R, 2J), shape (B,).

        As far ahead of the measured start as an answer says; NaN in blocks that are not held out.
        """
        found = self.search
        assert isinstance(found, Search)
        held = self.held_out(found.posed, found.final)
        ahead, windows = held.ahead(found.final), held.windows
        size = np.sqrt(((ahead / sigma[windows.source]) ** 2).mean(axis=1))
        block = found.posed.blocks.index(windows)
        with np.errstate(invalid='ignore'):
            return np.bincount(block, size) / np.bincount(block)


def best_reading(log: Logged, asked: Asked, until: float) -> Reading:
    """A search in the log as it is; its faults stay where it predicts surely better without.

    Of a fault that cannot be undone nothing is predicted: it stays unless known effects leave no
    more than noise. The searches are over at `until` [s of `time.monotonic`].
    """
    accused, began = log.in_the_way, time.monotonic()
    if asked.as_given or not accused:
        return _searched(log, asked, until)
    other = log.without(accused)
    if other is log:
        given = _searched(log, asked, until)
        return replace(given, log=log.doubted) if given.leaves_noise else given
    mended, now = _searched(other, asked, until), time.monotonic()
    until = min(until, now + asked.settings.numerics.reading_times * (now - began))
    given = _searched(log, asked.silently, until)
    return given if _predicts_better(mended, given) else replace(given, log=log.doubted)


def _predicts_better(other: Reading, given: Reading) -> bool:
    """Whether one reading predicts motion surely better than another, by blocks of time."""
    if isinstance(other.search, str) or isinstance(given.search, str):
        return isinstance(given.search, str)
    sigma = given.search.problem.sigma
    pairs = zip_longest(given.missed(sigma), other.missed(sigma), fillvalue=np.nan)
    first, second = np.array([*pairs]).T
    return better([first], [second]) > LIMITS.sure


def _searched(log: Logged, asked: Asked, until: float) -> Reading:
    """A search in one reading.

    A log that looks moved from outside mostly is whole: known effects may do what a hand does.
    """
    model, settings = asked.model, asked.settings
    cut = Cut.of(log.recordings, log.hold_out, settings, model, as_given=asked.as_given)
    if cut.mostly:
        cut = replace(cut, recordings=log.recordings, hold_out=log.hold_out)
    recordings, hold_out = cut.thinned
    facts = Facts.of(model.robot, recordings)
    reading = Reading(asked, log, cut, (*recordings, *hold_out), facts, '')
    asked.progress('noise and windows', 0)
    began = time.monotonic()
    try:
        posed = pose(recordings, hold_out, model, settings)
    except ValueError as error:
        return replace(reading, search=f'{error}: record 20 s or more with a changing input')
    now = time.monotonic()
    telling, most = settings.numerics.telling_times, settings.numerics.telling_longest
    until -= min(telling * (now - began), most * (until - now))
    return replace(reading, search=untestable(posed.problem) or _found(reading, posed, until))


def _found(reading: Reading, posed: Posed, until: float) -> Search:
    """The search, again with a finer step where that fits better."""
    asked, data = reading.asked, reading.recordings
    how = asked.extra, asked.progress, until, reading.facts.alike
    heard = partial(asked.hear, reading)
    found = search(data, asked.model, posed, *how, hear=heard)
    if reading.cut.mostly and not found.leaves_noise:
        return found
    fine = _finer(found, posed, asked.model)
    return search(data, asked.model, fine, *how, found.final, heard) if fine else found


def _finer(found: Search, posed: Posed, model: Model) -> Posed | None:
    """The problem with a finer step, to search again; None where that hardly fits any better.

    The step is that of the last fit, or shorter than the robot's own where this is too long for
    the model as given. A gain counts above what noise alone can give an effect.
    """
    fine, given, used = found.posed, model.integration_step, posed.problem.base
    if used.integration_step <= given:
        fine = refined(posed, found.null.point, posed.problem.numerics.finest_step * given)
    if fine.problem.base.integration_step == used.integration_step:
        return None
    gained = found.better_with(fine.problem.base) - found.better_with(used)
    return fine if gained > found.threshold else None
