# SPDX-License-Identifier: Apache-2.0
"""Whether an answer depends on the kernel that computes it, on processes, or on the order of bags.

    python benchmarks/same_kernels.py --first-seed 90101 --cases 5
    python benchmarks/same_kernels.py --bags BAG BAG --model torque_pendulum

The bags of a blind case (one hidden effect, two in every third), or those that are given, are
explained by `leo explain` in a process of its own: as the machine is, with OpenBLAS' kernels for
other processors (those that the processor can run, told by numpy), with numba's code for any
processor, with two processes in place of one, and with the bags in reverse. An answer is the same
where it has the same names at the same places, and every value within a tenth of the half-width of
its interval. Wholes such as the periods of a ripple have no interval and must be equal.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
import json
import os
from pathlib import Path
import subprocess
import sys
import tempfile
from typing import Any

from rich.progress import track
from threadpoolctl import threadpool_info

from leo_lab.blind.case import draw_case
from leo_lab.blind.record import record

KERNELS = {'Haswell': 'avx2', 'Sandybridge': 'avx', 'SkylakeX': 'avx512f'}
ALONE = {'OPENBLAS_NUM_THREADS': '1', 'LOKY_MAX_CPU_COUNT': '1'}
SHARE = 0.1
Values = dict[str, tuple[float, float]]


def ways() -> dict[str, dict[str, str]]:
    """What each way to compute sets in the environment."""
    flags = set(Path('/proc/cpuinfo').read_text().split()) if sys.platform == 'linux' else set()
    kernels = {
        name: {'OPENBLAS_CORETYPE': name} for name, flag in KERNELS.items() if flag in flags
    }
    return {
        'as it is': {},
        **kernels,
        'any processor': {'NUMBA_CPU_NAME': 'generic'},
        'two processes': {'LOKY_MAX_CPU_COUNT': '2'},
        'bags in reverse': {},
    }


def answer(bags: list[str], model: str, changed: dict[str, str]) -> tuple[list[str], Values]:
    """The names with their places, and each value with the half-width of its interval."""
    leo = str(Path(sys.executable).with_name('leo'))
    said = subprocess.run(
        [leo, 'explain', *bags, '--model', model, '--json'],
        env={**os.environ, **ALONE, **changed},
        capture_output=True,
        text=True,
        check=False,
    )
    if said.returncode not in (0, 1):
        raise SystemExit(f'same_kernels: leo explain: {said.stderr.strip()}')
    effects = json.loads(said.stdout)['effects']
    values = {
        f'{e["name"]}:{e["where"]}.{name}': (p['value'], _half(p))
        for e in effects
        for name, p in e['parameters'].items()
    }
    return sorted(f'{e["name"]}:{e["where"]}' for e in effects), values


def _half(parameter: dict[str, Any]) -> float:
    low, high = parameter.get('ci95') or (0.0, 0.0)
    return 0.5 * (high - low)


def apart(first: Values, other: Values) -> float:
    """The largest difference of a value, in half-widths of its interval."""
    return max(
        (
            abs(other[name][0] - value) / max(half, 1e-12 + 1e-9 * abs(value))
            for name, (value, half) in first.items()
        ),
        default=0.0,
    )


def cases(given: argparse.Namespace) -> Iterator[tuple[str, list[str], str]]:
    """A name, the bags and the model of each case."""
    if given.bags:
        yield ' '.join(given.bags), given.bags, given.model
        return
    for seed in range(given.first_seed, given.first_seed + given.cases):
        case = draw_case(seed, 'pair' if seed % 3 == 0 else 'effect')
        with tempfile.TemporaryDirectory() as folder:
            yield (
                f'{seed} {case.robot.name}',
                [*map(str, record(case, Path(folder)))],
                (case.robot.name),
            )


def main() -> None:
    """Run, print what differs, and count."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--first-seed', type=int, default=90101)
    parser.add_argument('--cases', type=int, default=5)
    parser.add_argument('--bags', nargs='+')
    parser.add_argument('--model')
    given = parser.parse_args()
    if given.bags and not given.model:
        parser.error('--bags need the --model that they are compared with')
    own = [info.get('architecture') for info in threadpool_info()]
    print(f'BLAS as it is: {", ".join(sorted({str(a) for a in own if a}))}')
    same, count = dict.fromkeys(ways(), 0), 0
    for name, bags, model in track(cases(given), total=1 if given.bags else given.cases):
        names, values = answer(bags, model, {})
        count += 1
        for way, changed in ways().items():
            turned = bags[::-1] if way == 'bags in reverse' else bags
            others, found = answer(turned, model, changed)
            off = apart(values, found) if names == others else float('inf')
            same[way] += off <= SHARE
            if off > SHARE:
                print(f'{name}: {names}; {way}: {others}, {off:.2f} half-widths apart')
    for way, number in same.items():
        print(f'{way}: the same answer in {number} of {count}')


if __name__ == '__main__':
    main()
