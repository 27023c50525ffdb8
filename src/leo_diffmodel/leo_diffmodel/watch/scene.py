# SPDX-License-Identifier: Apache-2.0
"""What is looked at: recordings, noise, effects to switch on, a model's held-out errors."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import errors, noise
from leo_diffmodel.compare.blocks import Blocks, make_blocks
from leo_diffmodel.compare.comparison import enough
from leo_diffmodel.compare.headline import Headline, headline
from leo_diffmodel.compare.known import with_known
from leo_diffmodel.compare.pushes import fast_enough, predict
from leo_diffmodel.compare.windows import Array, cut, spread_out, thin, Windows
from leo_diffmodel.explain.findings.held_out import held_out
from leo_diffmodel.explain.problem.candidates import candidates, limited
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.effects import Effect
from leo_sim.model import Model

TRAIN_SECONDS = 0.5
MOST_TRAINING, ON_GROUND = 40, 10
"""Windows that give a first value of an effect; of a robot on the ground."""


@dataclass(frozen=True)
class Timeline:
    """Where recordings `begin` on an axis, and their `first` stamps in their bags, (R,) [s]."""

    names: tuple[str, ...]
    first: Array
    begin: Array
    length: float

    @classmethod
    def of(cls, recordings: Sequence[Recording]) -> Self:
        first = np.array([float(r.episodes[0].t[0]) for r in recordings])
        lengths = [float(r.episodes[-1].t[-1]) for r in recordings] - first
        begin = np.concatenate([[0.0], np.cumsum(lengths)])
        return cls(tuple(r.path.name for r in recordings), first, begin[:-1], float(begin[-1]))

    def at(self, source: Array, time: Array) -> Array:
        """From bag times [s] to the axis; the shapes broadcast."""
        return np.asarray(time - self.first[source] + self.begin[source])

    def words(self, seconds: float) -> str:
        source = int(np.searchsorted(self.begin, seconds, side='right')) - 1
        time = seconds - self.begin[source] + self.first[source]
        return f'{self.names[source]} {time:.2f} s'


@dataclass(frozen=True)
class Score:
    rows: list[dict]
    """Against horizon: {steps, seconds, rmse, mean, noise_floor}, a figure per state."""
    figures: Array  # the headline's error of each state, shape (2J,)
    floor: Array  # what a perfect model would make of it, shape (2J,)


@dataclass(frozen=True)
class Scene:
    given: Model  # as named
    model: Model  # with what the recordings know of themselves
    recordings: tuple[Recording, ...]  # at a common rate
    sigma: Array  # noise of each recording and channel, shape (R, 2J)
    blocks: Blocks
    held: Windows  # that errors are given on
    train: Windows  # that first values are read from
    step: float  # one control period [s]
    candidates: Mapping[str, Candidate]  # effects that can be switched on, by `effect:where`
    timeline: Timeline  # the recordings one after the other

    @classmethod
    def of(
        cls,
        recordings: Sequence[Recording],
        model: Model,
        hold_out: Sequence[Recording] = (),
        extra: Iterable[Effect] = (),
        step: float | None = None,
    ) -> Self:
        """Read the noise, hold blocks out, cut windows.

        Recordings of `hold_out` are held out whole; without any, every fourth time block is.
        `extra` are effects of the user's own; a step [s] is the control period by default.
        UserError of too little data, or of rates that the model cannot follow.
        """
        everything = thin([*recordings, *hold_out])
        known = with_known(model, everything)
        step = errors.step_seconds(everything, step)
        blocks = make_blocks(everything[: len(recordings)], everything[len(recordings) :])
        with enough(everything, '20 s or more'):
            known = fast_enough(known, cut(everything, step))
            sigma = noise.estimate(known, noise.short_windows(everything))
            held, train = _held(everything, known, blocks), _train(everything, known, blocks)
        found = {c.label: limited(c, known, SETTINGS.grids) for c in candidates(known, extra)}
        timeline, data = Timeline.of(everything), tuple(everything)
        return cls(model, known, data, sigma, blocks, held, train, step, found, timeline)

    @property
    def headline(self) -> Headline:
        """Which error is shown as one figure: how far ahead, and whether rms or median."""
        return headline(self.model.robot, float(np.median(self.held.dt.sum(axis=1))))

    def score(self, model: Model) -> Score:
        """Errors of a model on the held-out windows, with the floor of its own predictions."""
        prediction = errors.predict_windows(model, self.held, self.sigma)
        kind = self.headline
        return Score(
            errors.horizon_table(prediction, self.step),
            np.array(kind.figures(prediction)[kind.statistic]),
            np.array(kind.floor(prediction)[kind.statistic]),
        )

    def size(self, model: Model, floor: Array) -> float:
        """The error of a model as one figure, in noise floors that are known, (2J,)."""
        states = predict(model, self.held, self.held.measured[:, 0])
        prediction = errors.Prediction(self.held, states, np.zeros_like(states))
        return in_floors(self.headline.figures(prediction)[self.headline.statistic], floor)


def in_floors(figures: Array | Sequence[float], floor: Array) -> float:
    """Errors of the states (2J,) as one figure: in noise floors, rms over the states."""
    return float(np.sqrt(np.mean((figures / floor) ** 2)))


def _held(recordings: Sequence[Recording], model: Model, blocks: Blocks) -> Windows:
    """Held-out windows, as long as explain's; ValueError where none fits."""
    for seconds in SETTINGS.grids.horizon_seconds:
        windows = held_out(recordings, blocks, model, seconds, remembering=True)
        if windows and windows.count:
            return windows
    raise ValueError('no window lies wholly in held-out data')


def _train(recordings: Sequence[Recording], model: Model, blocks: Blocks) -> Windows:
    """A few windows that share no time with held-out data; ValueError where none fits."""
    windows = cut(recordings, TRAIN_SECONDS, history=noise.HISTORY)
    trained = windows.take(blocks.train(windows))
    if not trained.count:
        raise ValueError('no window lies wholly in data that is not held out')
    return spread_out(trained, ON_GROUND if model.robot.contacts else MOST_TRAINING)
