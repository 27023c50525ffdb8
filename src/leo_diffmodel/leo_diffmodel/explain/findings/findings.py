# SPDX-License-Identifier: Apache-2.0
"""What verdict, doubts, sentence and rows of an answer are read from."""

from __future__ import annotations

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
"""Labels with the share of the held-out turns that choose them, most often first."""


class Rival(NamedTuple):
    """What else could stand in the place of an effect: how many nats it is behind.

    `same` says why the two are the same thing in these data; None where they are not.
    """

    candidate: Candidate
    behind: float
    same: str | None


class Own(NamedTuple):
    """The value that one recording asks for, and half its 95 % interval."""

    bag: str
    value: float
    half: float


class Range(NamedTuple):
    """From the least to the most of what was there."""

    low: float
    high: float
    unit: str


class Shown(NamedTuple):
    """Where a joint was in the data that show an answer; the load is the size of its torque."""

    joint: str
    angle: Range
    speed: Range
    load: Range


@dataclass(frozen=True)
class Part:
    """One effect of a fitted hypothesis, compared with the hypothesis without it.

    Attributes:
        saved: loss that the effect saves on training windows, and on those no fit saw [nats].
        before: held-out errors without it.
        after: held-out errors with it.
        share: of the held-out turns that hold it, by any name or as part of a wider law.
        rivals: what else could stand in its place, nearest first.
    """

    candidate: Candidate
    fit: Fit
    saved: tuple[float, float]
    before: Figures
    after: Figures
    share: float
    rivals: tuple[Rival, ...]

    @property
    def index(self) -> int:
        """Its place in the hypothesis."""
        return self.fit.hypothesis.candidates.index(self.candidate)

    def close(self, margin: float) -> list[Rival]:
        """Rivals of another kind that are fewer than `margin` nats behind."""
        return [r for r in self.rivals if not r.same and r.behind < margin]


@dataclass(frozen=True)
class Choices:
    """What is chosen where folds are left out of the choice, again and again.

    Attributes:
        kept: share of the turns that hold all chosen effects, and perhaps more.
        sets: labels of the effects of a set and the share of the turns that choose it, the
            chosen one first.
        instead: effects that are none of the chosen ones by any name.
        more: of these, those that are no narrower or wider law of a chosen one either.
    """

    kept: float
    sets: tuple[tuple[tuple[str, ...], float], ...]
    instead: Counts
    more: Counts


@dataclass(frozen=True)
class Findings:
    """What a search found, and all that follows from it by a fit or a prediction.

    Attributes:
        search: what was chosen, and from what; `final` with the constants that held-out
            recordings have of their own, without effects that the unknown law stands for.
        errors: of explain.json, against horizon: states, one_step and horizon.
        windows: how many held-out windows errors are given on.
        floor: errors that a perfect model would make there.
        ladder: held-out errors of the model as given, and with each effect added.
        effects: of the chosen hypothesis, in its order.
        singles: every effect that was fitted alone, best first.
        floors: what each chosen effect does to the prediction that no other one can [noise
            floors]; empty where these are too few for that to matter.
        own: of each chosen effect and each parameter that scales it (by its place in `theta`),
            the values that recordings ask for.
        choices: what is chosen where folds are left out.
        other: a set that leaves much less unexplained than the chosen one, in words; '' for none.
        refuted: a set of no more effects with a surely smaller held-out error, in words; '' for
            none.
        rest: what the chosen effects leave.
        shown: where the joints were at which the chosen effects act.
    """

    search: Search
    base: Model
    facts: Facts
    headline: Headline
    errors: dict
    windows: int
    floor: Figures
    ladder: tuple[tuple[str, Figures], ...]
    effects: tuple[Part, ...]
    singles: tuple[Part, ...]
    floors: tuple[float, ...]
    own: tuple[dict[int, list[Own]], ...]
    choices: Choices
    other: str
    refuted: str
    rest: Rest
    unknown: Unknown | None
    bags: tuple[str, ...]
    shown: tuple[Shown, ...]

    @property
    def gates(self) -> Gates:
        """What decides the answer."""
        return self.search.problem.gates

    @property
    def numerics(self) -> Numerics:
        """How much of it is listed, among others."""
        return self.search.problem.numerics

    @property
    def final(self) -> Fit:
        """The chosen hypothesis."""
        return self.search.final
