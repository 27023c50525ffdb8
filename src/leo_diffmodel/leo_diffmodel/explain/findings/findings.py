# SPDX-License-Identifier: Apache-2.0
"""What verdict, doubts, sentence and rows of an answer are read from."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import NamedTuple, TYPE_CHECKING

from leo_diffmodel.compare.headline import Figures, Headline
from leo_diffmodel.explain.estimate.fitted import Fit, Rest
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.settings import Gates, Numerics
from leo_sim.model import Model

if TYPE_CHECKING:
    from leo_diffmodel.explain.select.search import Search
    from leo_diffmodel.explain.unknown.answer import Unknown

Counts = tuple[tuple[str, float], ...]
"""Labels with the share of the resamples that choose them, most often first."""


class Rival(NamedTuple):
    """What else could stand in the place of an effect."""

    candidate: Candidate
    fit: Fit  # of the set that has it there
    behind: float  # [nats]
    same: str | None  # why the two are the same thing in these data; None where they are not


class Contender(NamedTuple):
    label: str
    by: float  # what it leaves less unexplained [nats]; or the share of the error that it saves
    lacks: tuple[str, ...]  # labels of the chosen effects that it does without


class RecordingValue(NamedTuple):
    """The value that one recording asks for, and half its 95 % interval."""

    bag: str
    value: float
    half: float


class Range(NamedTuple):
    low: float
    high: float
    unit: str

    def __str__(self) -> str:
        return f'{self.low:.2g} to {self.high:.2g} {self.unit}'


class Shown(NamedTuple):
    """Where a joint was in the data that show an answer; the load is the size of its torque."""

    joint: str
    angle: Range
    speed: Range
    load: Range


@dataclass(frozen=True)
class Part:
    """One effect of a fitted hypothesis, compared with the hypothesis without it."""

    candidate: Candidate
    fit: Fit
    without: Fit  # the others alone
    saved: tuple[float, float]  # loss, on training windows and on those no fit saw [nats]
    before: Figures  # held-out errors without it
    after: Figures  # held-out errors with it
    share: float  # of the resamples that hold it, by any name or as part of a wider law
    rivals: tuple[Rival, ...]  # nearest first

    @property
    def index(self) -> int:
        return self.fit.hypothesis.candidates.index(self.candidate)

    def close(self, margin: float) -> list[Rival]:
        """Rivals of another kind that are fewer than `margin` nats behind."""
        return [r for r in self.rivals if not r.same and r.behind < margin]


@dataclass(frozen=True)
class Choices:
    """What is chosen where folds are left out of the choice, again and again."""

    holds: tuple[frozenset[str], ...]  # labels of the chosen effects that each resample holds
    sets: tuple[tuple[tuple[str, ...], float], ...]  # labels and share, the chosen set first
    instead: Counts  # effects that are none of the chosen ones by any name
    more: Counts  # of these, those that are no narrower or wider law of a chosen one either

    def kept(self, labels: Collection[str]) -> float:
        """Share of the resamples that hold all of these chosen effects, and perhaps more."""
        return sum(held >= set(labels) for held in self.holds) / len(self.holds)


@dataclass(frozen=True)
class Findings:
    """What a search found, and all that follows from it by a fit or a prediction."""

    search: Search  # `null` and `final` completed; without effects that the law stands for
    base: Model
    facts: Facts
    headline: Headline
    errors: dict  # of explain.json, against horizon: states, one_step and horizon
    windows: int  # how many held-out windows errors are given on
    floor: Figures  # errors that a perfect model would make there
    ladder: tuple[tuple[str, Figures], ...]  # errors as given, and with each effect added
    effects: tuple[Part, ...]  # of the chosen hypothesis, in its order
    singles: tuple[Part, ...]  # every effect that was fitted alone, best first
    of_sets: tuple[Figures, ...]  # held-out errors of each set of the search
    # what each chosen effect does to the prediction that no other one can [noise floors]; empty
    # where these are too few for that to matter
    floors: tuple[float, ...]
    # of each chosen effect and each parameter that scales it, by its place in `theta`
    by_recording: tuple[dict[int, list[RecordingValue]], ...]
    choices: Choices
    others: tuple[Contender, ...]  # leave much less unexplained than the chosen set
    refuting: tuple[Contender, ...]  # have hardly more effects, surely a smaller held-out error
    rest: Rest  # what the chosen effects leave
    unknown: Unknown | None
    bags: tuple[str, ...]
    shown: tuple[Shown, ...]  # of the joints at which the chosen effects act

    @property
    def gates(self) -> Gates:
        return self.search.problem.gates

    @property
    def numerics(self) -> Numerics:
        return self.search.problem.numerics

    @property
    def final(self) -> Fit:
        return self.search.final
