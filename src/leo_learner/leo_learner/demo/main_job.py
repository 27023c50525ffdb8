# SPDX-License-Identifier: Apache-2.0
"""The main job: a robot with a secret, found out, repaired in the model, the policy retrained."""

from __future__ import annotations

from dataclasses import dataclass, field
import json
from pathlib import Path
import time
from typing import Any

from rich.console import Console

from leo_learner.demo.processes import Processes
from leo_msgs_py.errors import UserError
from leo_msgs_py.whole_file import write_whole
from leo_sim.model.model_file import load_model, save_model

ENOUGH = 1.5
"""A held-out error up to this times the noise floor leaves nothing for the difference model."""
RIG = 'dfki_simple_pendulum'
LOGS, HELD_OUT = '*data_measured.csv', 'energy_shaping'
ROBOT = {'robot': 'pendulum', 'realtime_factor': 0, 'start': 'random'}


@dataclass(frozen=True)
class Plan:
    """Sizes of the main job, chosen to end within six minutes on two cores."""

    hidden_seed: int = 1
    noise: tuple[float, float] = (0.001, 0.02)
    """Of the robot's sensors: angle [rad], rate [rad/s]."""
    seed: int = 1
    """Of every training, and of the robot's noise and starts."""
    steps: int = 8000
    """Training on the ideal model."""
    more_steps: int = 5000
    """Retraining, on the repaired model and on the robot, from the ideal policy."""
    transitions: int = 1000
    """Recorded for the repair."""
    episodes: int = 5
    """Played on the robot with each policy, from the same starts."""


@dataclass
class Found:
    """What came out; `demo.json`.

    Attributes:
        repair: what `leo repair --json` said.
        truth: what `leo reveal --json` said.
        returns: mean on the robot by policy: ideal, repaired, real.
        measured: `explain.json` of the real pendulum, None without its recordings.
        difference: whether a difference model was learned on top of the named effects.
        seconds: wall time.
    """

    repair: dict[str, Any] = field(default_factory=dict)
    truth: dict[str, Any] = field(default_factory=dict)
    returns: dict[str, float] = field(default_factory=dict)
    measured: dict[str, Any] | None = None
    difference: bool = False
    seconds: float = 0.0


class MainJob:
    """The steps of the main job in their order.

    Args:
        folder: of everything it writes.
        plan: sizes.
        console: where it says what it does.
        data: folder of recorded robots (`../shared/data`), or None.
    """

    def __init__(self, folder: Path, plan: Plan, console: Console, data: Path | None) -> None:
        self._folder, self._plan, self._console, self._data = folder, plan, console, data
        self.found = Found()

    def run(self) -> Found:
        """Everything; processes are ended whatever happens."""
        began = time.monotonic()
        with Processes(self._folder / 'logs') as processes:
            self._processes = processes
            measuring = self._begin_measured()
            self._start_robot('robot', self._plan.seed)
            self._learn_ideal()
            self._roll_out()
            self._begin_on_robot()
            model = self._repair()
            self._retrain(model)
            self._play()
            self.found.truth = processes.ask('reveal', str(self._folder / 'truth.sealed'))
            if measuring:
                self._finish_measured()
        self.found.seconds = time.monotonic() - began
        write_whole(self._folder / 'demo.json', json.dumps(vars(self.found), indent=1))
        return self.found

    def _say(self, text: str) -> None:
        self._console.print(text, style='bold')

    def _path(self, *parts: str) -> str:
        return str(self._folder.joinpath(*parts))

    def _start_robot(self, name: str, seed: int) -> None:
        plan = self._plan
        self._processes.node(
            name,
            'leo_sim',
            'robot',
            **ROBOT,
            seed=seed,
            hidden_seed=plan.hidden_seed,
            sealed=self._path('truth.sealed'),
            noise=[*plan.noise],
        )

    def _learn_ideal(self) -> None:
        self._say('1. a pendulum robot with a hidden effect runs; learn on the ideal model')
        self._processes.ask(
            'learn',
            '--robot',
            'pendulum',
            '--seed',
            str(self._plan.seed),
            '--steps',
            str(self._plan.steps),
            '-o',
            self._path('ideal'),
        )

    def _roll_out(self) -> None:
        self._say('2. roll the policy out on the robot, record it')
        self._processes.node(
            'diffmodel', 'leo_diffmodel', 'diffmodel', model='pendulum', bag=self._path('rollout')
        )
        self._processes.wait_for(self._folder / 'rollout', 'diffmodel')
        self._processes.ask(
            'play', self._policy('ideal'), '--collect', str(self._plan.transitions)
        )
        self._processes.stop('diffmodel')

    def _repair(self) -> str:
        self._say('3. compare, explain, repair the model')
        self.found.repair = self._processes.ask(
            'repair', self._path('rollout'), '--model', 'pendulum', '-o', self._path('repair')
        )
        self._console.print(self.found.repair['sentence'])
        return self._with_difference() if self._unexplained() else self._path('repair/model.yaml')

    def _unexplained(self) -> bool:
        one_step = self.found.repair['errors'].get('one_step')
        if one_step is None:
            return True
        return bool(one_step['mean']['after'] > ENOUGH * one_step['mean']['noise_floor'])

    def _with_difference(self) -> str:
        """The repaired model with a difference model for what no effect explains."""
        self._say('   the rest is learned by the difference model')
        weights = self._folder / 'rollout.difference' / 'difference-001.safetensors'
        self._processes.node(
            'diffmodel',
            'leo_diffmodel',
            'diffmodel',
            model=self._path('repair/model.yaml'),
            bag=self._path('rollout'),
            record=False,
        )
        self._processes.ask(
            'service',
            'call',
            '/difference_model/update',
            'std_srvs/srv/Trigger',
            '--timeout',
            '60',
        )
        self._processes.wait_for(weights, 'diffmodel')
        self._processes.stop('diffmodel')
        model = load_model(self._path('repair', 'model.yaml'))
        path = self._folder / 'repair' / 'with_difference.yaml'
        save_model(path, model.changed(difference_model=weights))
        self.found.difference = True
        return str(path)

    def _begin_on_robot(self) -> None:
        self._say('   beside it, for reference: retrain on the robot itself')
        self._processes.start(
            'learn_real',
            'learn',
            '--robot',
            'pendulum',
            '--on-robot',
            *self._more(),
            '-o',
            self._path('real'),
            '--json',
        )

    def _retrain(self, model: str) -> None:
        self._say('4. retrain on the repaired model')
        self._processes.ask('learn', '--model', model, *self._more(), '-o', self._path('repaired'))
        self._processes.wait('learn_real')

    def _more(self) -> list[str]:
        """Options of a retraining from the ideal policy."""
        plan = self._plan
        return [
            '--start',
            self._path('ideal'),
            '--steps',
            str(plan.more_steps),
            '--seed',
            str(plan.seed),
        ]

    def _play(self) -> None:
        self._say('5. play all three policies on the robot, from the same starts')
        self._processes.stop('robot')
        for number, name in enumerate(('ideal', 'repaired', 'real')):
            self._start_robot(f'robot{number}', 1000 + self._plan.seed)
            played = self._processes.ask(
                'play', self._policy(name), '--episodes', str(self._plan.episodes)
            )
            self.found.returns[name] = played['mean']
            self._processes.stop(f'robot{number}')

    def _policy(self, name: str) -> str:
        return self._path(name, 'policy.safetensors')

    def _begin_measured(self) -> bool:
        """Start the repair of the real pendulum's model, beside everything else."""
        if self._data is None or not (logs := sorted((self._data / RIG).glob(LOGS))):
            return False
        self._say('   beside it: the model of the real pendulum is repaired from its recordings')
        held_out = [log for log in logs if HELD_OUT in log.name]
        fitted = [log for log in logs if HELD_OUT not in log.name]
        for name, part in (('fitted', fitted), ('held_out', held_out)):
            self._processes.ask(
                'import',
                *map(str, part),
                '--map',
                RIG,
                '-o',
                self._path(RIG, name),
                '--bag-per-log',
            )
        self._processes.start(
            RIG,
            'repair',
            *self._bags('fitted'),
            '--hold-out',
            *self._bags('held_out'),
            '--model',
            'torque_pendulum',
            '-o',
            self._path(RIG, 'repair'),
        )
        return True

    def _bags(self, name: str) -> list[str]:
        """One bag a log: each run of the rig has a noise of its own."""
        return sorted(str(bag) for bag in (self._folder / RIG / name).iterdir())

    def _finish_measured(self) -> None:
        self._processes.wait(RIG)
        explained = self._folder / RIG / 'repair' / 'explain.json'
        if not explained.exists():
            raise UserError(f'the repair of {RIG} failed; see {self._path("logs", RIG)}.log')
        self.found.measured = json.loads(explained.read_text())
