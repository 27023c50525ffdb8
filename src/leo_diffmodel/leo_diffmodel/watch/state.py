# SPDX-License-Identifier: Apache-2.0
"""What the page shows, whoever looks: switches, errors, the film, where one is in it."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
import time
from typing import Any, Self

import numpy as np

from leo_diffmodel.compare.errors import state_names
from leo_diffmodel.report.text import quantity
from leo_diffmodel.watch.film import Film, Player
from leo_diffmodel.watch.handle import DIGITS, guess
from leo_diffmodel.watch.missing import MissingOfBoth
from leo_diffmodel.watch.scene import in_floors, Scene, Score
from leo_diffmodel.watch.setting import Answer, model_of, Setting, words, write_model
from leo_msgs_py.errors import UserError
from leo_sim.common.worker import Worker
from leo_sim.effects import Parameter
from leo_sim.model import Model

HORIZON = 0.5
SHORTEST, LONGEST = 0.05, 3.0  # of the horizon that predictions run over [s]


class State:
    """One state for all tabs; those that listen are notified of whatever is done to it.

    Errors and film are those of the switches at once; what takes longer follows in pieces, each
    time `go_on` is called.
    """

    def __init__(self, scene: Scene, folder: Path | None = None) -> None:
        self.scene = scene
        self.folder = folder  # where models may be written; None: nowhere
        self.setting = Setting()
        self.answer: Answer | None = None  # what explain found; None before it was asked
        self._past: list[Setting] = []
        self._moving: tuple[str, str] | None = None
        self._guessed: dict[str, dict[str, float]] = {}
        self.player = Player(scene.timeline.length)
        self.horizon = HORIZON  # over which the film predicts [s]
        self.shown = 0  # index of the state whose error the figures show
        self.seconds = 0.0  # what the last change took to compute
        self.states = state_names(scene.model)
        self.listeners: list[Callable[[], None]] = []
        self.drawing = Worker()
        self.given = self.now = scene.score(scene.model)  # as given, and with what is on
        self.without: Mapping[str, float] = {}
        """Of each effect that is on, the error if it alone were off [noise floors]."""
        self.film = Film.of(scene.recordings, self.horizon, scene.model)
        self.missing = MissingOfBoth(scene)
        self.chosen: tuple[int, int] | None = None
        """The joint whose missing torque is shown, and the number of the variable against which;
        None before there is one."""
        self._rest = self._follow(None)
        self.player.go(float(self.film.apart()[self.film.worst(self.shown)[0]]))

    @property
    def model(self) -> Model:
        return model_of(self.scene, self.setting, self.answer)

    @property
    def switched(self) -> dict[str, list[tuple[Parameter, float]]]:
        on, candidates = self.setting.on, self.scene.candidates
        return {c: [(p, on[c][p.name]) for p in candidates[c].parameters] for c in on}

    @property
    def floor(self) -> Score:
        """The errors whose floor is shown: those of the model that is less wrong."""
        return min(self.given, self.now, key=lambda s: np.sqrt(np.mean(s.figures**2)))

    @property
    def sizes(self) -> tuple[float, float, float]:
        """Held-out error as given, now, and by noise alone, in floors of the model as given."""
        shown = self.given.figures, self.now.figures, self.floor.floor
        given, now, noise = (in_floors(figures, self.given.floor) for figures in shown)
        return given, now, noise

    def in_print(self, label: str) -> list[str]:
        """`name = value unit` of an effect that is on, with its 95 % interval where explained."""
        words = []
        for p, value in self.switched[label]:
            found = self.answer and self.answer.in_print(label, p.name, value)
            words.append(f'{p.name} = {found or quantity(value, p.unit, DIGITS)}')
        return words

    @property
    def words(self) -> list[str]:
        return words(self.scene, self.setting)

    @property
    def can_undo(self) -> bool:
        return bool(self._past)

    def switch(self, label: str, on: bool) -> None:
        now = self.setting
        if on != (label in now.on):
            self._set(now.having(label, self._first(label)) if on else now.without(label))

    def move(self, label: str, name: str, value: float) -> None:
        if self.setting.on[label][name] != value:
            again = self._moving == (label, name)
            self._set(self.setting.moved(label, name, value), not again, (label, name))

    def undo(self) -> None:
        if self._past:
            self._set(self._past.pop(), remember=False)

    def clear(self) -> None:
        self._set(Setting())

    def found(self, explanation: Mapping[str, Any]) -> None:
        """Switch on what explain.json names, with its values; nothing where it names nothing."""
        self.answer, self._moving = Answer.of(explanation, self.scene), None
        if self.answer.setting.on:
            self._set(self.answer.setting)
        self.notify()

    def add(self) -> Path:
        """Write the model with what is switched on, as `leo add` does; UserError: it cannot."""
        if self.folder is None:
            raise UserError('start leo watch with -o DIR to write the model there')
        return write_model(self.folder, self.scene, self.setting, self.answer)

    def on(self, scene: Scene) -> Self:
        """The same switches on other data of the same robot; this state stays as it is."""
        other = type(self)(scene, self.folder)
        other.look_ahead(self.horizon)
        other.setting, other.answer = self.setting, self.answer
        other._compute()
        other.finish()
        return other

    def become(self, other: Self) -> None:
        """Show the data of another state, unless switches were moved while it was computed."""
        if (other.setting, other.horizon) != (self.setting, self.horizon):
            return
        self.scene, self.given, self.now = other.scene, other.given, other.now
        self.film, self.without, self.seconds = other.film, other.without, other.seconds
        self.missing, self._rest = other.missing, other._rest
        self.player.length = other.player.length
        self.notify()

    def look_ahead(self, seconds: float) -> None:
        if seconds == self.horizon:
            return
        self.horizon = seconds
        self.film = Film.of(self.scene.recordings, seconds, self.scene.model)
        self.film = self.film.repaired_by(self.model)
        self.notify()

    def show(self, index: int) -> None:
        if index != self.shown:
            self.shown = index
            self.notify()

    def choose(self, joint: int, variable: int) -> None:
        if (joint, variable) != self.chosen:
            self.chosen = joint, variable
            self.notify()

    def go(self, seconds: float) -> None:
        self.player.go(seconds)
        self.notify()

    def play_or_pause(self) -> None:
        self.player.play(not self.player.playing)
        self.notify()

    def at_speed(self, speed: float) -> None:
        if speed != self.player.speed:
            self.player.at_speed(speed)
            self.notify()

    def go_on(self) -> bool:
        """Compute the next piece of what follows the last change; whether there was one."""
        news = next(self._rest, None)
        if news:
            self.notify()
        return news is not None

    def finish(self) -> None:
        while self.go_on():
            pass

    def _first(self, label: str) -> dict[str, float]:
        if label not in self._guessed:
            self._guessed[label] = guess(self.scene, self.model, self.scene.candidates[label])
        return self._guessed[label]

    def _set(
        self, setting: Setting, remember: bool = True, moving: tuple[str, str] | None = None
    ) -> None:
        self._moving = moving
        if setting == self.setting:
            return
        if remember:
            self._past.append(self.setting)
        self.setting = setting
        self._guessed |= {label: dict(values) for label, values in setting.on.items()}
        self._compute()
        self.notify()

    def _compute(self) -> None:
        began, model = time.perf_counter(), self.model if self.setting.on else None
        self.now = self.scene.score(model) if model else self.given
        self.film = self.film.repaired_by(model)
        self.without = {k: v for k, v in self.without.items() if k in self.setting.on}
        self.missing.behind, self._rest = True, self._follow(model)
        self.seconds = time.perf_counter() - began

    def _follow(self, model: Model | None) -> Iterator[bool]:
        """What follows a change, in pieces; True where something is new."""
        for label in self.setting.on:
            self.without = {**self.without, label: self._size_without(label)}
            yield True
        yield from self.missing.follow(model)

    def _size_without(self, label: str) -> float:
        rest = self.setting.without(label)
        if not rest.on:
            return self.sizes[0]
        return self.scene.size(model_of(self.scene, rest, self.answer), self.given.floor)

    def notify(self) -> None:
        for listener in [*self.listeners]:
            listener()
