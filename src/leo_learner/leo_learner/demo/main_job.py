# SPDX-License-Identifier: Apache-2.0
"""The main job: a robot with a secret, found out, repaired in the model, the policy retrained."""

from collections.abc import Mapping
from dataclasses import dataclass, field
import json
from pathlib import Path
import shlex
import time
from typing import Any

from rich.console import Console

from leo_learner.demo.processes import Processes
from leo_msgs_py.console import Table
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.whole_file import write_whole
from leo_sim.model.model_file import load_model, save_model
from leo_sim.verbs.reveal import described

ENOUGH = 1.5
"""A held-out error up to this times the noise floor leaves nothing for the difference model."""
RIG = 'dfki_simple_pendulum'
LOGS, HELD_OUT = '*data_measured.csv', 'energy_shaping'
ROBOT = {'robot': 'pendulum', 'realtime_factor': 0, 'start': 'random'}
_KINDS = {'rmse': 'rms', 'median': 'median'}


@dataclass(frozen=True)
class Plan:
    """Sizes of the main job, chosen to end within six minutes on two cores."""

    hidden_seed: int = 1
    noise: tuple[float, float] = (0.001, 0.02)  # of the sensors: angle [rad], rate [rad/s]
    seed: int = 1  # of every training, and of the robot's noise and starts
    steps: int = 8000  # training on the ideal model
    more_steps: int = 5000  # retraining, on the repaired model and on the robot, from that policy
    transitions: int = 1000  # recorded for the repair
    episodes: int = 5  # played on the robot with each policy, from the same starts


@dataclass
class Found:
    repair: dict[str, Any] = field(default_factory=dict)  # said by `leo repair --json`
    truth: dict[str, Any] = field(default_factory=dict)  # said by `leo reveal --json`
    returns: dict[str, float] = field(default_factory=dict)  # mean on the robot by policy
    measured: dict[str, Any] | None = None  # `explain.json` of the real pendulum, if it is there
    difference: bool = False  # whether one was learned on top of the named effects
    seconds: float = 0.0  # wall time


class MainJob:
    def __init__(self, folder: Path, plan: Plan, console: Console, data: Path | None) -> None:
        self._folder, self._plan, self._console, self._data = folder, plan, console, data
        self.found = Found()

    def run(self) -> Found:
        began = time.monotonic()
        with Processes(self._folder / 'logs') as processes:
            self._processes = processes
            measuring = self._begin_measured()
            self._start_robot('robot', self._plan.seed)
            self._learn_ideal()
            self._roll_out()
            self._begin_on_robot()
            self._retrain(self._repair())
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
        plan, sealed = self._plan, self._path('truth.sealed')
        hidden = {'hidden_seed': plan.hidden_seed, 'sealed': sealed, 'noise': [*plan.noise]}
        self._processes.node(name, 'leo_sim', 'robot', **ROBOT, seed=seed, **hidden)

    def _learn_ideal(self) -> None:
        self._say('1 of 5: a pendulum robot with a hidden effect runs; learn on the ideal model')
        plan, words = self._plan, ('learn', '--robot', 'pendulum', '-o', self._path('ideal'))
        self._processes.ask(*words, '--seed', str(plan.seed), '--steps', str(plan.steps))

    def _roll_out(self) -> None:
        self._say('2 of 5: roll the policy out on the robot, record it')
        self._start_diffmodel('pendulum')
        self._processes.wait_for(self._folder / 'rollout', 'diffmodel')
        steps = str(self._plan.transitions)
        self._processes.ask('play', self._policy('ideal'), '--collect', steps)
        self._processes.stop('diffmodel')

    def _start_diffmodel(self, model: str, record: bool = True) -> None:
        given = {'model': model, 'bag': self._path('rollout'), 'record': record}
        self._processes.node('diffmodel', 'leo_diffmodel', 'diffmodel', **given)

    def _repair(self) -> str:
        self._say('3 of 5: compare, explain, repair the model')
        bag, out = self._path('rollout'), self._path('repair')
        self.found.repair = self._processes.ask('repair', bag, '--model', 'pendulum', '-o', out)
        self._console.print(self.found.repair['sentence'])
        return self._with_difference() if self._unexplained() else self._path('repair/model.yaml')

    def _unexplained(self) -> bool:
        mean = self.found.repair['errors'].get('one_step', {}).get('mean')
        return mean is None or bool(mean['after'] > ENOUGH * mean['noise_floor'])

    def _with_difference(self) -> str:
        self._say('   the rest is learned by the difference model')
        weights = self._folder / 'rollout.difference' / 'difference-001.safetensors'
        self._start_diffmodel(self._path('repair/model.yaml'), record=False)
        update = '/difference_model/update', 'std_srvs/srv/Trigger', '--timeout', '60'
        self._processes.ask('service', 'call', *update)
        self._processes.wait_for(weights, 'diffmodel')
        self._processes.stop('diffmodel')
        model = load_model(self._path('repair', 'model.yaml'))
        path = self._folder / 'repair' / 'with_difference.yaml'
        save_model(path, model.changed(difference_model=weights))
        self.found.difference = True
        return str(path)

    def _begin_on_robot(self) -> None:
        self._say('   meanwhile, for reference: retrain on the robot itself')
        words = 'learn', '--robot', 'pendulum', '--on-robot', '-o', self._path('real'), '--json'
        self._processes.start('learn_real', *words, *self._more())

    def _retrain(self, model: str) -> None:
        self._say('4 of 5: retrain on the repaired model')
        self._processes.ask('learn', '--model', model, *self._more(), '-o', self._path('repaired'))
        self._processes.wait('learn_real')

    def _more(self) -> list[str]:
        sizes = '--steps', str(self._plan.more_steps), '--seed', str(self._plan.seed)
        return ['--start', self._path('ideal'), *sizes]

    def _play(self) -> None:
        self._say('5 of 5: play all three policies on the robot, from the same starts')
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
        if self._data is None or not (logs := sorted((self._data / RIG).glob(LOGS))):
            return False
        self._say('   meanwhile: the model of the real pendulum is repaired from its recordings')
        for name, is_held_out in (('fitted', False), ('held_out', True)):
            part = [str(log) for log in logs if (HELD_OUT in log.name) == is_held_out]
            words = '--map', RIG, '-o', self._path(RIG, name), '--bag-per-log'
            self._processes.ask('import', *part, *words)
        bags = *self._bags('fitted'), '--hold-out', *self._bags('held_out')
        model = '--model', 'torque_pendulum', '-o', self._path(RIG, 'repair')
        self._processes.start(RIG, 'repair', *bags, *model)
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


def closing(found: Found, folder: Path, console: Console) -> None:
    table = Table(title=f'the main job, {found.seconds:.0f} s', show_header=False)
    table.add_column(style='bold')
    table.add_column(overflow='fold')
    table.add_row('named', named(found.repair))
    table.add_row('truth', '\n'.join(map(described, found.truth['effects'])))
    _add_error(table, found.repair, 'rmse')
    repaired = 'the repaired model' + (' + difference model' if found.difference else '')
    names = {'ideal': 'the ideal model', 'repaired': repaired, 'real': 'the robot itself'}
    for name, value in found.returns.items():
        table.add_row(f'return on the robot, trained on {names[name]}', f'{value:.1f}')
    reports = [folder / 'repair' / 'report.html']
    if found.measured:
        table.add_section()
        table.add_row('real pendulum, named', named(found.measured))
        _add_error(table, found.measured, 'median')
        reports.append(folder / RIG / 'repair' / 'report.html')
    console.print(table)
    for report in reports:
        console.print(f'report: {report.resolve()}', soft_wrap=True)
    console.print(f'watch the error fall: {shlex.join(watching(folder))}', soft_wrap=True)
    policy = (folder / 'repaired' / 'policy.safetensors').resolve()
    console.print(f'next: {leo("play", policy, "--model", "pendulum")}', soft_wrap=True)


def watching(folder: Path) -> list[str]:
    rollout, out = (str(folder.resolve() / name) for name in ('rollout', 'watch'))
    return ['leo', 'watch', rollout, '--model', 'pendulum', '-o', out]


def named(answer: Mapping[str, Any]) -> str:
    if not answer['effects']:
        return f'{answer["verdict"]}: {answer["sentence"]}'
    lines = [described(effect) + _confusable(effect) for effect in answer['effects']]
    return '\n'.join([f'({answer["verdict"]})', *lines])


def _confusable(effect: Mapping[str, Any]) -> str:
    others = [other['name'] for other in effect['confusable_with']]
    return f' (or {", ".join(others)})' if others else ''


def _add_error(table: Table, answer: Mapping[str, Any], kind: str) -> None:
    """Held-out errors; `kind` is rmse, or median where somebody may have pushed the robot."""
    ladder = answer['errors'].get('ladder')
    if not ladder:
        return
    given, repaired, floor = ladder[0], ladder[-2], ladder[-1]
    for k, state in enumerate(answer['errors']['states']):
        table.add_row(
            f'held-out {_KINDS[kind]} error after {given["seconds"]:.2g} s, {state["name"]}',
            f'{given[kind][k]:.4g} -> {repaired[kind][k]:.4g} {state["unit"]}, '
            f'noise floor {floor[kind][k]:.4g}',
        )
