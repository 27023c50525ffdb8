# SPDX-License-Identifier: Apache-2.0
"""LEO in MuJoCo beside our own dynamics: how far it is off, and how fast.

    python benchmarks/leo_mujoco.py [--states 200]

Both use the data sheet's springs and dampers under the feet; how sliding is held back and how
stops end a motion differ. Speeds are per second of process time; set OMP_NUM_THREADS=1.
"""

import argparse
import time

from leo_states import moved, sampled, States
import numpy as np

from leo_sim.model import Model, State

STEPS = (0.0002, 0.0005, 0.001, 0.002)
REFERENCE = 3e-5  # s


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n', maxsplit=1)[0])
    parser.add_argument('--states', type=int, default=200)
    given = parser.parse_args()
    table(sampled(Model('leo', engine='rigid', scheme='training'), given.states))


def table(states: dict[str, States]) -> None:
    """One control step of MuJoCo with several substeps, against ours with short ones."""
    truth = Model('leo', engine='rigid', integration_step=REFERENCE)
    count = min(len(part.q) for part in states.values())
    print(
        f'MuJoCo against our dynamics at {REFERENCE * 1e3:g} ms, one control step of 0.03 s: '
        f'rms difference over rms change, %; n = {count} each'
    )
    print(f'{"":26}{"angles":>8}{"rates":>8}{"99.9 % rad/s":>14}{"steps/s":>9}')
    for kind, part in states.items():
        q, dq = moved(truth, part, 0.03)
        for step in STEPS:
            angle, rate, speed = stepped(part, step)
            off = np.abs(rate - dq)[:, 2:]
            print(
                f'{kind:12}{step * 1e3:8.1f} ms   '
                f'{_percent((angle - q)[:, 2:], (q - part.q)[:, 2:]):8.2f}'
                f'{_percent(off, (dq - part.dq)[:, 2:]):8.2f}'
                f'{np.quantile(off, 0.999):14.2f}{speed:9.0f}'
            )


def stepped(states: States, step: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Angles and rates (N, 9) one control step on in MuJoCo, and control steps per second."""
    model = Model('leo', engine='mujoco', integration_step=step)
    many = [(State(q, dq), u) for q, dq, u in zip(*states, strict=True)]
    model.step(*many[0], 0.03)
    start = time.process_time()
    after = [model.step(state, volts, 0.03) for state, volts in many]
    speed = len(many) / (time.process_time() - start)
    return np.array([s.q for s in after]), np.array([s.dq for s in after]), speed


def _percent(error: np.ndarray, change: np.ndarray) -> float:
    return 100 * float(np.sqrt(np.mean(error**2) / np.mean(change**2)))


if __name__ == '__main__':
    main()
