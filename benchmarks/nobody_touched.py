# SPDX-License-Identifier: Apache-2.0
"""Logs that were taken for a hand, or for faults that are not there: what is said of them now.

    python benchmarks/nobody_touched.py                        # ten seeds of each kind
    python benchmarks/nobody_touched.py arm fault --seeds 900001:900061 -o out
    python benchmarks/nobody_touched.py --table out/nobody_touched.jsonl

A kind is a robot that MuJoCo or plain Python simulates, and what was done to its log. Every case
is right where what is wrong with the log is said first and nothing false is said as an error,
no hand among it. Arms are those of ../shared/cases/arm_everywhere.py. What has a line in the
results is not run again.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
import importlib.util
from pathlib import Path
import sys
import time
from types import ModuleType
from typing import Any

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.faults.catalogue import FAULTS
from leo_diffmodel.faults.find import find_faults
from leo_diffmodel.faults.mending import mapped
from leo_diffmodel.outside.outside import moved_from_outside
from leo_lab.blind.faulty_logs import Drawn, SIZES
from leo_lab.blind.spoil import logged, spoil
from leo_lab.result_lines import append_result, read_results
from leo_sim.description.robot import load_robot, Robot
from leo_sim.model import Model

CASES = Path(__file__).resolve().parents[2] / 'shared/cases'
ARMS = ('friction', 'payload', 'masses', 'one', 'none')
COUNT = 2 * np.pi / 4096
"""rad of an encoder, rad/s of a servo's speed."""
OF_ARMS = (
    *('input_scale', 'input_sign', 'input_late', 'input_exchanged', 'input_dead', 'angle_zero'),
    *('speed_scale', 'speed_sign', 'speed_zero', 'speed_late', 'speed_wraps', 'time_stretch'),
)
"""Faults that are drawn for arms."""
Array = np.ndarray


@dataclass(frozen=True)
class Case:
    """Logs of a robot, the faults that are in them with their joints, and whether a hand is."""

    logs: list[Recording]
    robot: Robot
    faults: tuple[tuple[str, str], ...] = ()
    hand: bool = False


def arms() -> ModuleType:
    """The script that makes arms."""
    spec = importlib.util.spec_from_file_location('arm_everywhere', CASES / 'arm_everywhere.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def arm(
    seed: int,
    case: str = 'friction',
    least: int = 4,
    seconds: Sequence[float] = (16.0,),
    at: Callable[..., Any] | None = None,
) -> Case:
    """An arm of arm_everywhere.py with at least so many joints, one log for each of `seconds`."""
    make, g = arms(), np.random.default_rng(seed)
    links = make.links(g)
    while len(links) < least:
        links = make.links(g)
    folder = Path(f'/tmp/arm_{seed}_{case}_{least}')
    folder.mkdir(exist_ok=True)
    urdf, count = folder / 'robot.urdf', len(links)
    urdf.write_text(make.urdf(links, np.full(count, 1e3)))
    known = make.compiled(urdf, links)
    reach = np.array([link['reach'] for link in links])
    ways = [at(g, reach) if at else make.motion(g, reach) for _ in seconds]
    usual = np.maximum(make.needed(known, ways[0], seconds[0]).std(0), 0.05)
    dry, viscous = usual * g.uniform(0.15, 0.9, count), usual * g.uniform(0.1, 0.8, count)
    viscous /= np.maximum(reach, 0.3)
    only = np.arange(count) == int(g.integers(count)) if case == 'one' else case != 'none'
    factors = g.uniform(0.88, 1.12, count) if case == 'masses' else None
    payload = [float(g.uniform(1, 3)), 0.8 * links[-1]['length'], 0.0, 0.05]
    payload = payload if case == 'payload' else None
    limits = 6 * usual + 2 * dry + (4.9 * payload[0] if payload else 0)
    urdf.write_text(make.urdf(links, limits))
    real = make.compiled(urdf, links, factors, payload)
    real.dof_damping[:], real.dof_frictionloss[:] = viscous * (only & (case != 'one')), dry * only
    (folder / 'robot.yaml').write_text(_description(links, limits))
    robot, noise, logs = load_robot(folder), np.random.default_rng([seed, 1]), []
    for way, long in zip(ways, seconds, strict=True):
        t, q, dq, u = make.drive(real, known, way, long, limits)
        q, dq = q + 2e-4 * noise.normal(size=q.shape), dq + 5e-3 * noise.normal(size=q.shape)
        logs.append(log(robot, t, q, dq, u + 0.01 * usual * noise.normal(size=q.shape)))
    return Case(logs, robot)


def _description(links: list[dict], limits: Array) -> str:
    rows = [
        f'  joint_{i}: {{limit: {{value: {limit:.4g}, unit: N m}}, '
        f'rotor_inertia: {{value: {link["rotor"]:.6g}, unit: kg m2}}}}'
        for i, (link, limit) in enumerate(zip(links, limits, strict=True), 1)
    ]
    angles = ', '.join(f'joint_{i}: 0' for i in range(1, len(links) + 1))
    head = ['name: arm', 'base: fixed', 'input: torque', 'control_period: 0.002']
    head += ['integration_step: 0.0005', 'state_rate: 500', 'episode_seconds: 10']
    head += ['gravity: {value: 9.81, unit: m/s2}', 'actuators:', *rows, 'start_poses:']
    return '\n'.join([*head, '  nominal:', f'    angles: {{{angles}}}']) + '\n'


def log(
    robot: Robot, t: Array, q: Array, dq: Array, u: Array, rates: str = 'measured'
) -> Recording:
    """A recording of one episode."""
    e = Episode(t, q, dq, u, np.ones(u.shape, dtype=bool))
    names = tuple(robot.joint_names), tuple(a.joint for a in robot.actuators), robot.input
    period = float(np.median(np.diff(t)))
    return Recording(Path('simulated'), '', *names, period, (e,), {}, rates=rates)


def spoilt(case: Case, *faults: tuple[str, int, float], every: int = 5) -> Case:
    """The case with faults (name, joint, size) in its first log, sampled at 100 Hz."""
    (e,) = case.logs[0].episodes
    names = case.logs[0].joints
    for name, j, value in faults:
        e = spoil(name, e, j, j, value)
    rows = slice(None, None, every)
    u = e.inputs[: len(e.t) // every * every].reshape(len(e.t) // every, every, -1).mean(axis=1)
    t, q, dq = (x[rows][: len(u)] for x in (e.t, e.q, e.dq))
    told = tuple((n, '' if FAULTS[n].whole_log else names[j]) for n, j, _ in faults)
    return Case([log(case.robot, t, q, dq, u)], case.robot, told)


def healthy(seed: int) -> Case:
    """Arms of each case in turn, one log to learn from and one held out."""
    return arm(seed, ARMS[seed % len(ARMS)], seconds=(16.0, 8.0))


def six(seed: int) -> Case:
    """Six joints or more with friction of their own, every other one with a payload."""
    return arm(seed, ('friction', 'payload')[seed % 2], 6)


def pauses(seed: int) -> Case:
    """Moves and pauses at 100 Hz; while a joint stands its angle and speed repeat exactly."""

    def way(g: np.random.Generator, reach: Array) -> Callable[[float], tuple[Array, ...]]:
        poses = g.uniform(-1, 1, (40, len(reach))) * reach * g.choice([0.05, 0.3, 1.0], len(reach))
        poses[0] = 0

        def at(t: float) -> tuple[Array, ...]:
            k, s = int(t // 2.6), float(np.clip((t % 2.6) / 1.1, 0, 1))
            d, on = poses[k + 1] - poses[k], s < 1
            path = 10 * s**3 - 15 * s**4 + 6 * s**5, 30 * s**2 - 60 * s**3 + 30 * s**4
            return (
                poses[k] + d * path[0],
                d * path[1] / 1.1 * on,
                d * (60 * s - 180 * s**2 + 120 * s**3) / 1.21 * on,
            )

        return at

    case = spoilt(arm(seed, least=5, seconds=(40.0,), at=way))
    (e,) = case.logs[0].episodes
    still = np.abs(np.gradient(e.q, e.t, axis=0)) < 0.02
    still[1:] &= still[:-1]
    still[0] = False
    last = np.maximum.accumulate(np.where(still, 0, np.arange(len(e.t))[:, None]), axis=0)
    q, dq = (np.take_along_axis(x, last, 0) for x in (e.q, np.where(still, 0.0, e.dq)))
    if seed % 2:
        q, dq = COUNT * np.round(q / COUNT), 0.024 * np.round(dq / 0.024)
    return replace(case, logs=[log(case.robot, e.t, q, dq, e.inputs)])


def dead(seed: int) -> Case:
    """Seven joints; the efforts of three are logged as 0 but for three twentieths of the time."""
    case, g = spoilt(arm(seed, least=7, seconds=(24.0,))), np.random.default_rng(seed)
    (e,) = case.logs[0].episodes
    u, lost = e.inputs.copy(), np.sort(g.choice(7, 3, replace=False))
    for j in lost:
        piece = np.arange(len(u)) * 20 // len(u)
        u[~np.isin(piece, g.choice(20, 3, replace=False)), j] = 0.0
    told = tuple(('input_dead', case.logs[0].joints[j]) for j in lost)
    return Case([log(case.robot, e.t, e.q, e.dq, u)], case.robot, told)


def turned(seed: int) -> Case:
    """Seven joints; the sign of three efforts is turned."""
    joints = np.random.default_rng(seed).choice(7, 3, replace=False)
    long = arm(seed, least=7, seconds=(24.0,))
    return spoilt(long, *(('input_sign', int(j), -1.0) for j in sorted(joints)))


def exchanged(seed: int) -> Case:
    """The torques of two joints stand in each other's columns."""
    case = spoilt(arm(seed, seconds=(20.0,)))
    (e,) = case.logs[0].episodes
    a, b = np.random.default_rng(seed).choice(e.q.shape[1], 2, replace=False)
    u = e.inputs.copy()
    u[:, [a, b]] = u[:, [b, a]]
    return Case([log(case.robot, e.t, e.q, e.dq, u)], case.robot, (('input_exchanged', ''),))


def filtered(seed: int) -> Case:
    """All speeds come through a filter of 0.13 to 0.3 s."""
    case, tau = arm(seed, seconds=(20.0,)), np.random.default_rng(seed).uniform(0.13, 0.3)
    count = len(case.logs[0].joints)
    return spoilt(case, *(('speed_filter', j, float(tau)) for j in range(count)))


def elastic(seed: int) -> Case:
    """A gear of 5 to 12 Hz between motor and link, the encoder at the motor, a chirp to 14 Hz."""
    g, dt, link = np.random.default_rng(seed), 2e-4, 0.1496
    motor, hertz = 0.02 * g.uniform(0.6, 1.5), g.uniform(5, 12)
    stiff = (2 * np.pi * hertz) ** 2 * motor * link / (motor + link)
    viscous, dry = g.uniform(0.01, 0.05), g.uniform(0.02, 0.08)
    q = w = x = v = 0.0
    rows = []
    for t in dt * np.arange(round(30 / dt)):
        u = 2.2 * np.sin(2 * np.pi * (0.1 * t + 6.95 * t**2 / 30))
        rows.append((t, q, w, u))
        spring = stiff * (q - x) + 0.05 * (w - v)
        w = slowed(w + (u - spring - viscous * w) / motor * dt, dry / motor * dt)
        v += (spring - 2.997 * np.sin(x)) / link * dt
        q, x = q + w * dt, x + v * dt
    t, q, w, u = np.array(rows[::25]).T[..., None]
    robot = load_robot(CASES / 'nobody_touched/elastic_gear_robot')
    noisy = q + g.normal(0, 2e-4, q.shape), w + g.normal(0, 5e-3, w.shape)
    return Case([log(robot, t[:, 0], *noisy, u)], robot)


def slowed(rate: float, by: float) -> float:
    """A rate after dry friction took so much of it, or all."""
    return float(np.sign(rate) * max(abs(rate) - by, 0.0))


def servo(seed: int, hertz: float, stamped: float) -> tuple[Array, Array, Array, Robot]:
    """Stamps, angles and goals of an XL330 whose loop runs at so many hertz."""
    g, robot = np.random.default_rng(seed), load_robot('xl330_pendulum')
    count = round(40 * hertz)
    steps = np.repeat(g.uniform(-0.9, 0.9, count), g.integers(hertz // 4, hertz, count))[:count]
    goals = steps + 0.2 * np.sin(2 * np.pi * g.uniform(0.3, 0.8) * np.arange(count) / hertz)
    dt, inertia = 1 / hertz / 80, 1e-4 + 0.49 * 0.01 + 0.00257
    q = w = 0.0
    angles = []
    for goal in goals:
        angles.append(COUNT * round(q / COUNT))
        for _ in range(80):
            volts = 7.4 * float(np.clip(1.1509 * (goal - q), -1, 1))
            torque = 0.286 * (volts - 0.286 * w) / 2.0 - 0.49 * 9.81 * 0.1 * np.sin(q)
            w = slowed(w + torque / inertia * dt, 0.02 / inertia * dt)
            q += w * dt
    return np.arange(count) / stamped, np.array(angles), goals, robot


def goals(seed: int) -> Case:
    """The column of the angle holds goals, that of the goals what was measured."""
    t, q, goal, robot = servo(seed, 50.0, 50.0)
    rates = np.gradient(goal, t)
    wrong = log(robot, t, goal[:, None], rates[:, None], q[:, None], 'absent')
    return Case([wrong], robot, (('goal_exchanged', 'pivot'),))


def stamped(seed: int) -> Case:
    """A loop of 23.5 to 24.5 Hz, stamped as 30."""
    hertz = float(np.random.default_rng(seed).uniform(23.5, 24.5))
    t, q, goal, robot = servo(seed, hertz, 30.0)
    late = log(robot, t, q[:, None], np.gradient(q, t)[:, None], goal[:, None], 'absent')
    return Case([late], robot, (('time_stretch', ''),))


def sign_bit(seed: int) -> Case:
    """Negative speeds of a servo were read as positive numbers, in one of two ways."""
    g, dt, inertia, weight = np.random.default_rng(seed), 5e-4, 0.1495, 2.997
    drive = np.repeat(g.uniform(-2.2, 2.2, 200), g.integers(12, 50, 200))[:2000]
    viscous, q, w, rows = g.uniform(0.01, 0.06), 0.0, 0.0, []
    for u in drive:
        rows.append((q, w, u))
        for _ in range(20):
            w += (u - weight * np.sin(q) - viscous * w) / inertia * dt
            q += w * dt
    q, w, u = np.array(rows).T[..., None]
    unit, name = (COUNT, 0.024)[seed % 2], ('speed_wraps', 'speed_sign_bit')[seed // 2 % 2]
    top = unit * (65536 if name == 'speed_wraps' else 32768)
    robot = load_robot('torque_pendulum')
    raw = logged(name, np.zeros(0), unit * np.round(w / unit), top)
    t = 0.01 * np.arange(len(q))
    told = ((name, 'pivot'),)
    return Case([log(robot, t, q + g.normal(0, 5e-4, q.shape), raw, u)], robot, told)


def hand(seed: int) -> Case:
    """A pendulum that a hand leads; its motor is off, carries the weight, or holds against it."""
    g, robot = np.random.default_rng(seed), load_robot('torque_pendulum')
    t = 0.01 * np.arange(2500)
    f, p = g.uniform(0.1, 0.6, (2, 5, 1))
    way = 0.45 * (g.normal(size=(5, 1)) * np.sin(2 * np.pi * (f * t + 3 * p))).sum(axis=0)
    q, dq = way[:, None], np.gradient(way, t)[:, None]
    load = Model(robot).rigid.load(q)
    u = [0 * q, -g.uniform(0.9, 1.1) * load, -g.uniform(0.5, 2) * q][seed % 3]
    noisy = q + g.normal(0, 1e-3, q.shape), dq + g.normal(0, 0.02, q.shape)
    return Case([log(robot, t, *noisy, u)], robot, hand=True)


def fault(seed: int) -> Case:
    """One fault, drawn with its joint, at an arm with friction at all joints."""
    g = np.random.default_rng([seed, 1])
    case, name = arm(seed, seconds=(20.0,)), OF_ARMS[seed % len(OF_ARMS)]
    (e,) = case.logs[0].episodes
    j = int(g.integers(name == 'angle_zero', e.q.shape[1]))  # joint 1 stands upright
    speed, side = float(e.dq[:, j].std()), float(g.choice([-1, 1]))
    run = Drawn(0.01, speed, float(np.ptp(e.q[:, j])), side)
    multiple = float(np.exp(g.uniform(0, np.log(30))))
    sizes = {
        'input_exchanged': lambda m, run: 1.0,
        'input_dead': lambda m, run: float(g.uniform(0.3, 0.85)),
        'speed_wraps': lambda m, run: float(g.uniform(50, 1500)),
        **SIZES,
    }
    return spoilt(case, (name, j, sizes[name](multiple, run)))


KINDS: dict[str, Callable[[int], Case]] = {
    f.__name__: f
    for f in (
        *(healthy, six, pauses, dead, turned, elastic, exchanged, goals, sign_bit, stamped),
        *(filtered, hand, fault),
    )
}


def judged(kind: str, seed: int) -> dict:
    """What is said of one case: its line of the results."""
    case = KINDS[kind](seed)
    model, began = Model(case.robot), time.process_time()
    found = find_faults(case.logs, model)
    seconds = time.process_time() - began
    right = [mapped(r, [f for f in found if f.error]) for r in case.logs]
    forces = [f for r in right for f in moved_from_outside(r, model)]
    said = [(f.code, f.joint) for f in found if f.error]
    first = [f.code for f in found][:1]
    false = [s for s in said if s not in case.faults]
    hands = [s.what for s in forces if s.code == 'hand']
    named = first == [name for name, _ in case.faults[:1]] or not case.faults
    if kind == 'elastic':
        named = any('a resonance at' in s.what for s in forces)
    return {
        'kind': kind,
        'seed': seed,
        'joints': len(case.robot.joint_names),
        'truth': case.faults,
        'said': said,
        'found': [[f.code, f.joint, f.value, f.error] for f in found],
        'forces': sorted({f'{s.code}: {s.what}' for s in forces}),
        'false': bool(false) or (bool(hands) and not case.hand),
        'right': (named and {*case.faults} <= {*said}) if not case.hand else bool(hands),
        'seconds': seconds,
    }


def table(lines: list[dict]) -> Iterator[str]:
    """A line of text for each kind."""
    for kind in dict.fromkeys(line['kind'] for line in lines):
        mine = [line for line in lines if line['kind'] == kind]
        right, false = (sum(line[k] for line in mine) for k in ('right', 'false'))
        usual = float(np.median([line['seconds'] for line in mine]))
        yield f'{kind:10s} right {right} of {len(mine)}, false {false}, {usual:.1f} s'
        for line in mine:
            if line['false'] or not line['right']:
                yield f'  {line["seed"]}: {line["truth"]} said {line["said"]} {line["forces"]}'


def main() -> int:
    """Run what has no line yet, and tell all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('kinds', nargs='*', help=', '.join(KINDS))
    parser.add_argument('--seeds', default='1:11', metavar='FIRST:END')
    parser.add_argument('-o', '--output', type=Path, default=Path('out/nobody_touched'))
    parser.add_argument('--table', type=Path, metavar='FILE.jsonl')
    options = parser.parse_args()
    file = options.table or options.output / 'nobody_touched.jsonl'
    if not options.table:
        done = {(line['kind'], line['seed']) for line in read_results(file)}
        seeds = range(*map(int, options.seeds.split(':')))
        open_ = [(k, s) for k in options.kinds or KINDS for s in seeds if (k, s) not in done]
        with ProcessPoolExecutor(2) as pool:
            for n, line in enumerate(pool.map(judged, *zip(*open_, strict=True)), 1):
                append_result(file, line)
                print(f'{n} of {len(open_)}', end='\r', file=sys.stderr)
    print('\n'.join(table(read_results(file))))
    return 0


if __name__ == '__main__':
    sys.exit(main())
