# SPDX-License-Identifier: Apache-2.0
"""Algorithm 5 of the thesis: learn on model + difference, try on the robot, learn the difference.

A plain class: where the robot is and where the difference model comes from is the node's
business. What has been done is written down after every phase, so a process that was killed goes
on with the phase it was in, from the checkpoint of its training.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
import json
from pathlib import Path
import time
from typing import Any, cast, Protocol

import gymnasium
import numpy as np

from leo_diffmodel.difference.model import DifferenceModel, from_bytes
from leo_learner.ddpg.agent import Training
from leo_learner.ddpg.configs import Config
from leo_learner.environment.env import ModelEnv, training_model
from leo_learner.learning.checkpoint import newest, start_from
from leo_learner.learning.collect import collect
from leo_learner.learning.policy import Policy
from leo_learner.learning.run import learn, POLICY
from leo_learner.training.loop import play
from leo_msgs_py.errors import one_line, UserError
from leo_msgs_py.whole_file import write_whole
from leo_sim.model import Model
from leo_sim.model.model_file import write_effects
from leo_sim.model.physics import differing, of_model

DONE = 'algorithm5.json'  # what of a run has been done, in its folder
UPDATE_SIGMA = 0.12  # exploration once there is a difference model (docs/reference/leo.md 10)
KEPT_REPLAY = 100_000
"""Transitions of the first training every later one starts from (docs/reference/leo.md 11.5)."""


@dataclass(frozen=True)
class Settings:
    updates: int = 1  # of the difference model, at most
    patience: int = 2  # updates without a better test on the robot after which it ends
    first_steps: int = 10_000  # training on the model alone
    update_steps: int = 6000  # training after each update
    transitions: int = 5000  # gathered on the robot before each update
    tests: int = 5  # episodes per test on the robot
    network: bool = True  # train on what the network says too, not on the named effects alone
    thesis: bool = False
    """Keep the first training's replay and explore less after an update, as the thesis does;
    without it a retraining keeps the networks alone, which learns faster."""
    seed: int = 0  # of everything drawn


@dataclass
class Done:
    """What has been done so far; the file `DONE` in the run's folder."""

    update: int = 0  # number of the round, 0 is the training on the model alone
    phase: str = 'train'  # what is next: `train`, `test`, `collect`, `update` or `end`
    version: int = 0  # of the difference model in use, 0 for none
    tests: list[float] = field(default_factory=list)  # mean return on the robot after each round
    driver: int = 0  # round whose policy drives the robot: the last no worse than its driver
    samples: int = 0  # control steps the robot has made, tests included
    seconds: float = 0.0  # wall time of all phases
    of: dict[str, Any] = field(default_factory=dict)
    """What a run that goes on must have in common; empty in files of earlier versions."""


class DifferenceSource(Protocol):
    def newer(self, version: int) -> bytes:
        """Weights of a later version than `version`, once an update has made them."""


@dataclass
class Algorithm5:
    """Rounds of train, test, collect, update until `settings.updates` are made.

    A run that was interrupted goes on in its folder; UserError where that holds another run, or
    one that cannot be read.
    """

    folder: Path
    model: Model  # the ideal one, or one repaired by named effects
    config: Config
    settings: Settings
    robot: gymnasium.Env  # the real one
    source: DifferenceSource
    alive: Callable[[], bool] = lambda: True  # False ends a training early, after its episode
    say: Callable[[str], None] = print  # receives one line per phase
    start: Path | None = None  # run of `leo learn` that takes the place of the first training
    quiet: bool = False  # no progress lines

    def __post_init__(self) -> None:
        self.done = self._read()
        if self.done.phase == 'end' and not self._over():
            self.done.phase = 'collect'  # more updates are asked for than it was to make

    def run(self) -> bool:
        """All that is left to do; False where it was stopped before."""
        while self.done.phase != 'end':
            began = time.monotonic()
            ended = getattr(self, f'_{self.done.phase}')()
            self.done.seconds += time.monotonic() - began
            write_whole(self.folder / DONE, json.dumps(asdict(self.done), indent=1))
            if not ended:
                return False
        return True

    @property
    def best(self) -> Path:
        return self._round(self.done.driver) / POLICY

    def policies(self) -> list[Path]:
        return [self._round(update) / POLICY for update in range(len(self.done.tests))]

    def _train(self) -> bool:
        update, settings = self.done.update, self.settings
        config = self.config
        if update and settings.thesis:
            config = replace(config, noise_sigma=UPDATE_SIGMA)
        model, difference = self.corrected()
        training = Training(ModelEnv(training_model(model), difference), config, self._seed())
        if update:  # the networks behind the robot's driver
            start_from(self._round(self.done.driver), training)
        if update and settings.thesis:
            training.replay.load(newest(self._round(0)) / 'replay.npz', KEPT_REPLAY)
        steps = settings.update_steps if update else settings.first_steps
        on = f'model + difference {self.done.version}' if update else 'the model'
        self.say(f'round {update}: training {steps} steps on {on}')
        outcome = learn(
            training,
            self.model.robot,
            steps,
            self._round(update),
            title=f'round {update}',
            quiet=self.quiet,
            alive=self.alive,
        )
        if outcome.finished:
            self.done.phase = 'test'
        return outcome.finished

    def _test(self) -> bool:
        done = self.done
        policy = Policy.load(self._round(done.update) / POLICY)

        def act(observation: np.ndarray) -> np.ndarray:
            done.samples += 1
            return policy(observation)

        result = float(play(self.robot, act, self.settings.tests).mean())
        done.tests.append(result)
        self.say(f'round {done.update}: return on the robot {result:.1f}{self._decide(result)}')
        done.phase = 'end' if self._over() else 'collect'
        return True

    def _decide(self, result: float) -> str:
        """Let the newest policy drive the robot unless it is worse than its driver; says so."""
        done = self.done
        before = done.tests[done.driver]
        if result >= before:
            done.driver = done.update
            return ''
        return f', worse than {before:.1f}: the policy of round {done.driver} goes on driving it'

    def _over(self) -> bool:
        done, settings = self.done, self.settings
        since = done.update - int(np.argmax(done.tests))
        return done.update >= settings.updates or since >= settings.patience

    def _collect(self) -> bool:
        steps = self.settings.transitions
        self.say(f'round {self.done.update}: gathering {steps} transitions on the robot')
        collect(self.robot, Policy.load(self.best), steps, self._seed())
        self.done.samples += steps
        self.done.phase = 'update'
        return True

    def _update(self) -> bool:
        self.say(f'round {self.done.update}: updating the difference model')
        weights = self.source.newer(self.done.version)
        difference = from_bytes(weights)
        write_whole(self.folder / f'difference-{difference.version:03d}.safetensors', weights)
        self.done.version = difference.version
        effects = self.corrected()[0].effects
        named = ', '.join(f'{e.effect.name} at {", ".join(e.where)}' for e in effects)
        self.say(
            f'difference model {difference.version}, from {difference.trained_on} steps'
            f'{named and f", on top of {named}"}'
        )
        self.done.update += 1
        self.done.phase = 'train'
        return True

    def gather_again(self) -> None:
        """What was gathered for the update that is next has been lost."""
        self.done.phase = 'collect'
        self.done.samples -= self.settings.transitions

    def corrected(self) -> tuple[Model, DifferenceModel | None]:
        """The model with the effects named so far, and the difference model on top of it."""
        if not self.done.version:
            return self.model, None
        path = self.folder / f'difference-{self.done.version:03d}.safetensors'
        difference = from_bytes(path.read_bytes(), str(path))
        model = difference.model_beside(path.with_suffix('.yaml'), self.model)
        return model, difference if self.settings.network else None

    def _round(self, update: int) -> Path:
        if update == 0 and self.start is not None:
            return self.start
        return self.folder / f'round-{update}'

    def _seed(self) -> int:
        return 1000 * self.settings.seed + self.done.update

    def _read(self) -> Done:
        path, of = self.folder / DONE, self._of()
        if not path.exists():
            return Done(phase='train' if self.start is None else 'test', of=of)
        try:
            done = Done(**json.loads(path.read_text()))
        except (OSError, TypeError, ValueError) as error:
            raise UserError(
                f'{path} cannot be read ({one_line(error)}); give another folder, or '
                'remove it to start anew'
            ) from error
        if said := differing(done.of, of):
            raise UserError(f'{self.folder} holds a run with {said}; give another folder')
        return done

    def _of(self) -> dict[str, Any]:
        """What a run that is gone on with must have in common with this one."""
        of = {
            **of_model(self.model),
            'model': write_effects(self.model.effects),
            'start': self.start and str(self.start),
            'seed': self.settings.seed,
            'config': asdict(self.config),
        }
        return cast(dict[str, Any], json.loads(json.dumps(of)))
