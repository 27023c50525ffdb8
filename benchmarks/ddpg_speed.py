# SPDX-License-Identifier: Apache-2.0
"""Speed of DDPG on LEO beside Stable-Baselines3, SBX and CleanRL, in one process on one core.

    pip install -r benchmarks/requirements-ddpg.txt   (needed by nothing else)
    python benchmarks/ddpg_speed.py [--steps 2000] [--rounds 3] [--cleanrl FILE]

The same environment, hidden layers, batch of 64, one update per step. The programs take turns;
a rate is steps over processor time, so that other work on the machine matters less; printed are
medians over the rounds. CleanRL is one script with layers of 256 and a batch given on its command
line; it is run as it is, from a file of yours. Start-up and peak memory come first, the update
alone against the rate of large matrix products last.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from itertools import pairwise
import os
from pathlib import Path
import re
import resource
import runpy
import statistics
import subprocess
import sys
import time
from typing import Any

import numpy as np
import torch

from leo_lab.autograd_update import AutogradUpdate
from leo_learner.ddpg.agent import Agent, Training
from leo_learner.ddpg.configs import Config, THESIS_WALKING
from leo_learner.environment.env import ModelEnv, training_env
from leo_learner.training.replay import Batch, Replay, Transition
from leo_sim.model import Model

WARM_UP = 200
BATCH = 64
LAYERS = {'400-300': (400, 300), '256-256': (256, 256)}
PACKAGES = {'stable_baselines3': 'Stable-Baselines3', 'sbx': 'SBX'}
"""Modules with a DDPG of one interface, in PyTorch and in JAX."""
LARGE = 2048
"""Rows and columns of the matrices whose product is the machine's best rate."""
LARGE_PRODUCTS = {'torch.mm': torch.mm, 'numpy': lambda a, b: np.dot(a.numpy(), b.numpy())}


def main() -> None:
    """Print everything."""
    options = _options()
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    torch.set_num_threads(1)
    start_up()  # first: a child's peak memory is never below that of its parent
    for name, hidden in LAYERS.items():
        compare(name, hidden, options)
    for name, hidden in LAYERS.items():
        update(name, hidden, options.rounds)


def compare(name: str, hidden: tuple[int, ...], options: argparse.Namespace) -> None:
    """Steps per second of the programs with one size of networks, and ratios to ours."""
    programs: dict[str, Callable[[int], float]] = {
        'ours': ours(hidden),
        **{name: of_package(module, hidden) for module, name in PACKAGES.items()},
    }
    if options.cleanrl and hidden == (256, 256):
        programs['CleanRL'] = lambda steps: cleanrl(options.cleanrl, steps)
    rates: dict[str, list[float]] = {program: [] for program in programs}
    for _ in range(options.rounds):
        for program, run in programs.items():
            rates[program].append(run(options.steps))
    print(f'\nenvironment and update, layers {name}, steps per second of processor time')
    for program, each in rates.items():
        ratio = statistics.median(a / b for a, b in zip(rates['ours'], each, strict=True))
        print(f'  {program:18} {statistics.median(each):7.1f}   ours is {ratio:.2f} times as fast')


def environment() -> ModelEnv:
    """LEO as it is trained on."""
    return training_env(Model('leo'))


def ours(hidden: tuple[int, ...]) -> Callable[[int], float]:
    """Steps per second of this project's DDPG from where the last call ended."""
    config = replace(
        THESIS_WALKING, hidden=hidden, warm_up=WARM_UP, batch=BATCH, test_interval=10**9
    )
    training = Training(environment(), config, 0)

    def run(steps: int) -> float:
        def enough() -> None:
            training.stop = training.steps >= until

        until, training.stop = training.steps + steps, False
        before, began = training.steps, time.process_time()
        training.run(10**9, between=enough)
        return (training.steps - before) / (time.process_time() - began)

    run(WARM_UP)
    return run


def of_package(module: str, hidden: tuple[int, ...]) -> Callable[[int], float]:
    """Steps a second of CPU time of the DDPG of `PACKAGES`, as a function of how many."""
    from stable_baselines3.common.noise import OrnsteinUhlenbeckActionNoise

    noise = OrnsteinUhlenbeckActionNoise(np.zeros(6), 0.2 * np.ones(6), dt=1.0)
    agent = import_module(module).DDPG(
        'MlpPolicy',
        environment(),
        learning_rate=1e-3,
        buffer_size=300_000,
        batch_size=BATCH,
        learning_starts=WARM_UP,
        tau=0.001,
        train_freq=1,
        gradient_steps=1,
        action_noise=noise,
        policy_kwargs={'net_arch': list(hidden)},
        device='cpu',
        seed=0,
    )

    def run(steps: int) -> float:
        before, began = agent.num_timesteps, time.process_time()
        agent.learn(steps, reset_num_timesteps=False)
        return (agent.num_timesteps - before) / (time.process_time() - began)

    run(WARM_UP + 100)
    return run


def cleanrl(script: Path, steps: int) -> float:
    """Steps a second of CPU time of CleanRL's DDPG, from what a process of its own prints."""
    command = [
        sys.executable,
        __file__,
        '--run-cleanrl',
        str(script),
        '--env-id',
        'Leo-v0',
        '--no-cuda',
        '--batch-size',
        str(BATCH),
        '--policy-frequency',
        '1',
        '--learning-starts',
        str(WARM_UP),
        '--total-timesteps',
        str(WARM_UP + 200 + steps),
    ]
    printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    [rate] = re.findall(r'rate ([0-9.]+)', printed)
    return float(rate)


def run_cleanrl(script: str, arguments: list[str]) -> None:
    """Run the script as it is, on our environment and the processor's clock."""
    import gymnasium

    gymnasium.register('Leo-v0', environment)
    marks: list[tuple[int, float]] = []
    sys.argv = [script, *arguments]

    class Writer:
        def add_text(self, *given: Any) -> None:
            """Nothing is kept."""

        def add_scalar(self, name: str, value: float, step: int) -> None:
            """Note when each hundredth step was done."""
            if name == 'charts/SPS':
                marks.append((step, time.process_time()))

        def close(self) -> None:
            """Nothing to close."""

    import torch.utils.tensorboard

    torch.utils.tensorboard.SummaryWriter = lambda path: Writer()
    sys.path.insert(0, str(Path(script).resolve().parent.parent))
    runpy.run_path(script, run_name='__main__')
    (first, began), (last, ended) = marks[0], marks[-1]
    print(f'rate {(last - first) / (ended - began):.2f}')


def update(name: str, hidden: tuple[int, ...], rounds: int) -> None:
    """One update by either agent, the best of its turns, against large matrix products."""
    config = replace(THESIS_WALKING, hidden=hidden)
    agents = {
        'autograd': Agent(14, 6, config, 0, AutogradUpdate),
        'derived gradients': Agent(14, 6, config, 0),
    }
    batch, work = _batch(), flops(config)
    times: dict[str, list[float]] = {kind: [] for kind in agents}
    rates: dict[str, list[float]] = {library: [] for library in LARGE_PRODUCTS}
    for _ in range(max(rounds, 5)):
        for library, multiply in LARGE_PRODUCTS.items():
            rates[library].append(large_product(multiply))
        for kind, agent in agents.items():
            times[kind].append(_timed(lambda agent=agent: agent.learn(batch), 200))
    best = {library: max(each) for library, each in rates.items()}
    print(
        f'\nupdate, layers {name}: {work / 1e6:.0f} million operations; products of {LARGE} x '
        f'{LARGE} matrices: ' + ', '.join(f'{k} {v / 1e9:.0f} GFLOP/s' for k, v in best.items())
    )
    for kind, each in times.items():
        seconds = min(each)
        shares = ', '.join(f'{100 * work / seconds / v:.0f} % of {k}' for k, v in best.items())
        print(
            f'  {kind:18} {1e3 * seconds:6.2f} ms ({1e3 * statistics.median(each):.2f} median): '
            f'{shares}'
        )


def flops(config: Config) -> float:
    """Operations of the matrix products that an update cannot do without.

    Forward: target actor, target critic, critic, actor, critic; backward: critic and actor by
    their weights and by the inputs of all layers but the first; the critic by the action.
    """
    first, last = config.hidden
    actor = [14, first, last, 6]
    critic = [(14, first), (first + 6, last), (last, 1)]
    a = sum(n * m for n, m in pairwise(actor))
    c = sum(n * m for n, m in critic)
    inner_a, inner_c = a - 14 * first, c - 14 * first - 6 * last
    products = 2 * a + 3 * c + (c + inner_c) + (a + inner_a) + (last + 6 * last)
    return 2.0 * config.batch * products


def large_product(multiply: Callable[[torch.Tensor, torch.Tensor], torch.Tensor]) -> float:
    """Operations per second of a product of large matrices."""
    a, b = torch.rand(LARGE, LARGE), torch.rand(LARGE, LARGE)
    return 2.0 * LARGE**3 / _timed(lambda: multiply(a, b), 3)


def start_up() -> None:
    """Seconds from the command to the first updates, and peak memory of a whole run's replay."""
    began = time.perf_counter()
    command = [sys.executable, __file__, '--run-some']
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    print(
        f'\nstart-up to the first updates {float(said[0]) - began:.1f} s; peak memory with '
        f'{THESIS_WALKING.replay} transitions held {int(said[1]) / 1024:.0f} MiB'
    )


def run_some() -> None:
    """A process that learns a little: prints when it began to, and its peak memory [KiB]."""
    rate = ours((400, 300))
    del rate
    print(time.perf_counter())
    replay = Replay(THESIS_WALKING.replay, 14, 6)
    for _ in range(THESIS_WALKING.replay):
        replay.add(Transition(np.zeros(14), np.zeros(6), 0.0, np.zeros(14), False))
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)


def _batch() -> Batch:
    rng = np.random.default_rng(0)
    columns = rng.normal(size=(BATCH, 14)), rng.uniform(-1, 1, (BATCH, 6)), rng.normal(size=BATCH)
    return Batch(
        *(c.astype('f4') for c in (*columns, rng.normal(size=(BATCH, 14)), np.zeros(BATCH)))
    )


def _timed(call: Callable[[], Any], times: int) -> float:
    call()
    began = time.process_time()
    for _ in range(times):
        call()
    return (time.process_time() - began) / times


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--steps', type=int, default=2000, help='per program and round')
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--cleanrl', type=Path, help="CleanRL's ddpg_continuous_action.py")
    return parser.parse_args()


if __name__ == '__main__':
    if sys.argv[1:2] == ['--run-cleanrl']:
        run_cleanrl(sys.argv[2], sys.argv[3:])
    elif sys.argv[1:2] == ['--run-some']:
        run_some()
    else:
        main()
