# SPDX-License-Identifier: Apache-2.0
"""Cases of `leo blind` by three Dask workers and by three processes, and with workers killed.

    python benchmarks/cluster.py [--cases 30] [--rounds 2] [--kills 10] [--killed-cases 60]

First the same cases by `--jobs` and by `--scheduler`, in turn on the same cores, with one of each
before that is not counted (imports, compiled kernels): are the lines the same to the bit, and what
does the cluster cost? Then a worker is killed again and again while cases run: is there one line
of each? Seeds are for development.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
import json
import os
from pathlib import Path
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time

import psutil

from leo_lab.result_lines import read_results

BIN = Path(sys.executable).parent
WORKERS, FIRST_SEED = 3, 3001
ALONE = {'OPENBLAS_NUM_THREADS': '1', 'LOKY_MAX_CPU_COUNT': '1'}
KEPT = {'MALLOC_TRIM_THRESHOLD_': '33554432', 'MALLOC_MMAP_THRESHOLD_': '33554432'}
"""Else Dask has each array's memory given back at once, which takes 7 % of a case."""
NO_ANSWER = ('seconds', 'cpu_seconds', 'commit')
"""Fields of a line: how long it took, and the code, which has another name once it is edited."""


@contextmanager
def cluster() -> Iterator[tuple[str, psutil.Process]]:
    """A scheduler with its workers: its address, and the process that keeps them alive."""
    with tempfile.TemporaryDirectory() as folder:
        told = Path(folder) / 'scheduler.json'
        words = ['scheduler', '--host', '127.0.0.1', '--port', '0', '--no-dashboard']
        scheduler = _dask(*words, '--scheduler-file', told)
        while not told.exists() or not told.read_text():
            time.sleep(0.1)
        address = json.loads(told.read_text())['address']
        words = ['worker', address, '--nworkers', WORKERS, '--nthreads', '1', '--no-dashboard']
        keeper = _dask(*words, '--local-directory', folder)
        try:
            yield address, psutil.Process(keeper.pid)
        finally:
            for process in (keeper, scheduler):
                process.terminate()
                process.wait()


def _dask(*words: object) -> subprocess.Popen:
    command = [BIN / 'dask', *map(str, words)]
    quiet, env = subprocess.DEVNULL, {**os.environ, **ALONE, **KEPT}
    return subprocess.Popen(command, stdout=quiet, stderr=quiet, env=env)


def blind(cases: int, folder: Path, *words: object) -> tuple[list[dict], float]:
    """The lines of cases without and with an effect, half of each, and how long they took [s]."""
    half = cases // 2
    command = [BIN / 'leo', 'blind', '--no-effect', half, '--cases', cases - half]
    command += ['--first-seed', FIRST_SEED, '-o', folder, *words]
    began = time.monotonic()
    subprocess.run(
        [*map(str, command)], check=True, capture_output=True, env={**os.environ, **ALONE}
    )
    took = time.monotonic() - began
    lines = read_results(folder / 'results.jsonl')
    return sorted(lines, key=lambda x: (x['kind'], x['seed'])), took


def answers(lines: list[dict]) -> str:
    """What lines answer, as text to the last digit."""
    return json.dumps([{k: v for k, v in x.items() if k not in NO_ANSWER} for x in lines])


def compare(cases: int, rounds: int) -> None:
    """The same cases both ways, in turn."""
    ways = {'--jobs': [], '--scheduler': []}
    said = set()
    with cluster() as (address, _), tempfile.TemporaryDirectory() as name:
        words = {'--jobs': WORKERS, '--scheduler': address}
        for number in range(rounds + 1):
            for way, times in ways.items():
                folder = Path(name) / f'{way}_{number}'
                lines, took = blind(cases if number else WORKERS, folder, way, words[way])
                if number:
                    times.append(took)
                    said.add(answers(lines))
                    print(f'round {number}: {way} {took:.1f} s', flush=True)
    jobs, dask = (statistics.median(times) for times in ways.values())
    print(f'{cases} cases, {rounds} rounds: answers {"the same" if len(said) == 1 else "DIFFER"}')
    more = f'{100 * dask / jobs - 100:+.1f} %'
    print(f'median {jobs:.1f} s by --jobs, {dask:.1f} s by --scheduler: {more}')


def kill(cases: int, kills: int) -> None:
    """A worker killed so often while cases run."""
    over, rng = threading.Event(), random.Random(0)
    with cluster() as (address, keeper), tempfile.TemporaryDirectory() as name:
        done: list[int] = []
        hunter = threading.Thread(target=_hunt, args=(keeper, kills, rng, over, done))
        hunter.start()
        lines, took = blind(cases, Path(name), '--scheduler', address)
        over.set()
        hunter.join()
    once = len({(x['kind'], x['seed']) for x in lines})
    if len(done) < kills:
        sys.exit(f'only {len(done)} of {kills} workers were killed; give more --killed-cases')
    told = f'{len(lines)} lines of {cases}, {once} different'
    print(f'{len(done)} workers killed in {took:.0f} s: {told}')


def _hunt(
    keeper: psutil.Process, kills: int, rng: random.Random, over: threading.Event, done: list[int]
) -> None:
    """Kill one of the workers every few seconds."""
    while len(done) < kills and not over.wait(rng.uniform(4.0, 12.0)):
        children = keeper.children(recursive=True)
        workers = [p for p in children if p.name().startswith('dask worker')]
        if workers:
            victim = rng.choice(workers)
            os.kill(victim.pid, signal.SIGKILL)
            done.append(victim.pid)


def main() -> None:
    """Both parts."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--cases', type=int, default=30)
    parser.add_argument('--rounds', type=int, default=2)
    parser.add_argument('--kills', type=int, default=10)
    parser.add_argument('--killed-cases', type=int, default=60)
    given = parser.parse_args()
    compare(given.cases, given.rounds)
    kill(given.killed_cases, given.kills)


if __name__ == '__main__':
    main()
