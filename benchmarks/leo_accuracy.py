# SPDX-License-Identifier: Apache-2.0
"""What LEO's simulation is worth: hand calculations, accuracy, speed, purity, the thesis' gap.

    python benchmarks/leo_accuracy.py [--states 1000] [--pairs 10000]

Speeds are per second of process time on one thread; set OMP_NUM_THREADS=1.
"""

import argparse
import hashlib
from multiprocessing import get_context
import time

from leo_states import moved, sampled, States, stepping
import numpy as np

from leo_sim.effects import place
from leo_sim.kinematics.frames import Kinematics
from leo_sim.model import Model, State

REFERENCE = 3e-5  # s
YARDSTICK = '0.01 ms'
KINDS = ('airborne', 'stance', 'touch-down')


def main() -> None:
    """Print every part."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n', maxsplit=1)[0])
    parser.add_argument('--states', type=int, default=1000)
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--pairs', type=int, default=10_000)
    given = parser.parse_args()
    by_hand()
    states = sampled(Model('leo', engine='rigid', scheme='training'), given.states, given.seed)
    accuracy(states)
    speed(states)
    gap(states, given.seed)
    purity(states, given.pairs)


def by_hand() -> None:
    """Mass, free fall, momentum, energy with free motors, foot heights of the start pose."""
    model = Model('leo')
    masses = sum(body.mass for body in model.laws.bodies.values())
    start = model.start()
    over = model.spheres.touch(start.q, start.dq, ()).over[0] * 1e3
    print(
        f'mass {masses:.6f} kg (data sheet 1.85702); start: left heel {over[0]:+.2f} mm, '
        f'left toe {over[1]:+.2f} mm over the floor'
    )
    rng = np.random.default_rng(0)
    state = State(start.q + [0, 1, 0, 0, 0, -0.3, 0, 0, 0], rng.normal(0, 1, 9))
    before, seconds = _mechanics(model, state), 0.3
    for _ in range(10):
        state = model.step(state, np.zeros(6), seconds / 10, enabled=np.zeros(6, dtype=bool))
    after = _mechanics(model, state)
    print(
        f'free fall {seconds} s, motors free: vertical momentum {after[1] - before[1]:+.6f} '
        f'(by hand {-masses * 9.81 * seconds:+.6f}) kg m/s, horizontal '
        f'{after[0] - before[0]:+.1e} (0), energy {after[2] - before[2]:+.1e} J of '
        f'{before[2]:.3f} J'
    )


def _mechanics(model: Model, state: State) -> tuple[float, float, float]:
    """Momentum x and z, kg m/s, and energy, J."""
    mass, _ = model.rigid.mass_and_bias(state.q, state.dq)
    momentum = mass @ state.dq
    frames = Kinematics(model.robot.joints).frames(state.q)
    potential = sum(
        9.81 * body.mass * frames[name].point(body.com)[2]
        for name, body in model.laws.bodies.items()
    )
    return momentum[0], momentum[1], 0.5 * state.dq @ momentum + potential


def accuracy(states: dict[str, States]) -> None:
    """One control step of each scheme against one with short substeps."""
    truth = Model('leo', engine='rigid', integration_step=REFERENCE)
    print(
        f'\nrms error of one control step over rms change, %, against {1e3 * REFERENCE:g} ms; '
        f'n = {len(states["stance"].q)} states each'
    )
    print(
        f'{"":22}{"angles":>8}{"rates":>8}{"rates but 3/1000":>17}'
        f'{"99.9 % rad/s":>14}{"worst rad/s":>13}'
    )
    for kind in KINDS:
        given = states[kind]
        q, dq = moved(truth, given, 0.03)
        schemes = {
            scheme: Model('leo', engine='rigid', scheme=scheme)
            for scheme in ('reference', 'training')
        }
        for scheme, model in {**schemes, YARDSTICK: truth.changed(integration_step=1e-5)}.items():
            angle, rate = moved(model, given, 0.03)
            wrong, change = (rate - dq)[:, 2:], (dq - given.dq)[:, 2:]
            keep = np.argsort(np.abs(wrong).max(axis=-1))[: -max(1, 3 * len(q) // 1000)]
            print(
                f'{kind + " " + scheme:22}'
                f'{_percent((angle - q)[:, 2:], (q - given.q)[:, 2:]):8.3f}'
                f'{_percent(wrong, change):8.3f}{_percent(wrong[keep], change[keep]):17.3f}'
                f'{np.quantile(np.abs(wrong), 0.999):14.3f}{np.abs(wrong).max():13.2f}'
            )


def _percent(error: np.ndarray, change: np.ndarray) -> float:
    return 100 * float(np.sqrt(np.mean(error**2) / np.mean(change**2)))


def speed(states: dict[str, States], count: int = 150) -> None:
    """Control steps per second of `Model.step`."""
    print('\ncontrol steps of 0.03 s per second of process time, one state at a time')
    for engine in ('pybullet', 'rigid'):
        for scheme in ('reference', 'training'):
            model = Model('leo', engine=engine, scheme=scheme)
            rates = [_speed(model, states[kind], count) for kind in KINDS]
            print(
                f'{engine:9}{scheme:10}'
                + ''.join(f'  {kind} {rate:5.0f}' for kind, rate in zip(KINDS, rates, strict=True))
            )


def _speed(model: Model, states: States, count: int) -> float:
    many = [(State(q, dq), u) for q, dq, u in zip(*states, strict=True)][:count]
    model.step(*many[0], 0.03)
    start = time.process_time()
    for state, volts in many:
        model.step(state, volts, 0.03)
    return len(many) / (time.process_time() - start)


def gap(states: dict[str, States], seed: int) -> None:
    """The thesis' ideal and real LEO: mean squared one-step difference over the 18 states."""
    ideal = Model('leo', engine='rigid')
    parts = zip(states['stance'], states['touch-down'], strict=True)
    name = 'random voltages, a foot on the ground or landing'
    sets = {name: States(*map(np.concatenate, parts))}
    for volts in (6.0, 8.6):
        name = f'legs driven in turn by square waves of {volts:g} V, until a fall'
        sets[name] = stepping(Model('leo', engine='rigid', scheme='training'), volts, seed)
    print(
        '\nideal against real (torso 1.25 kg, 0.03 N m s/rad), MSE over 18 states of a step of '
        '0.03 s (thesis 0.0763 on its policy; a study 0.05 to 0.065)'
    )
    for name, given in sets.items():
        print(f'{_gap(ideal, given):8.4f}  {len(given.q)} states: {name}')


def _gap(ideal: Model, states: States) -> float:
    real = ideal.changed(
        effects=[place(ideal.robot, 'viscous_friction', 'all', b=0.03)],
        constants={**ideal.constants, 'links.torso.mass': 1.25},
    )
    pairs = zip(moved(real, states, 0.03), moved(ideal, states, 0.03), strict=True)
    return float(np.mean(np.concatenate([a - b for a, b in pairs], axis=-1) ** 2))


def purity(states: dict[str, States], pairs: int) -> None:
    """Whether the bits are the same in any order and in two processes."""
    joined = States(*map(np.concatenate, zip(*states.values(), strict=True)))
    index = np.arange(pairs) % len(joined.q)
    volts = np.random.default_rng(1).uniform(-8.6, 8.6, (pairs, 6))
    given = States(joined.q[index], joined.dq[index], volts)
    orders = [np.arange(pairs), np.random.default_rng(2).permutation(pairs)]
    with get_context('spawn').Pool(2) as pool:
        digests = pool.starmap(_digest, [(given, order) for order in orders])
    same = 'bit-identical' if len(set(digests)) == 1 else 'DIFFERENT'
    print(
        f'\n{pairs} pairs of state and voltages, two orders, two processes, engine pybullet: '
        f'{same} ({digests[0][:12]})'
    )


def _digest(given: States, order: np.ndarray) -> str:
    model = Model('leo', scheme='training')
    after = {i: model.step(State(given.q[i], given.dq[i]), given.volts[i], 0.03) for i in order}
    hashed = hashlib.sha256()
    for i in sorted(after):
        hashed.update(after[i].q.tobytes() + after[i].dq.tobytes())
    return hashed.hexdigest()


if __name__ == '__main__':
    main()
