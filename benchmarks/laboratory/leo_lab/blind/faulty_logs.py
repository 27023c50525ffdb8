# SPDX-License-Identifier: Apache-2.0
"""Faults of logs, drawn by seed and hidden in simulated bags: are they found, and how large?

A case is a robot, a random run, noise or an encoder's counts, in half of the cases a physical
effect of 1 to 10 times its usual small size, and one fault of a size from one to thirty times
what just shows (`SIZES`), or none. The run is simulated at 1 kHz, spoilt there and then sampled,
so that a late channel is late and not smoothed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
import tempfile
import time

import numpy as np

from leo_diffmodel.bags.arrays import write_runs
from leo_diffmodel.bags.recording import Episode, read_bag, Recording
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.faults.catalogue import FAULTS
from leo_diffmodel.faults.find import find_faults
from leo_diffmodel.faults.found import Found
from leo_diffmodel.faults.mending import runs_of
from leo_lab.blind.spoil import spoil
from leo_sim.description.robot import load_robot, Robot
from leo_sim.effects import place, Placed
from leo_sim.model import Model
from leo_sim.model.batch import rollout

FINE = 0.001
"""s: step of the simulation."""
SLOWEST = 0.01
"""s: largest period of a log; inputs change at its multiples, as they do where one node sends
them and writes the log. A servo's goal that changes within a row is not the mean of the two."""
ROBOTS = {
    'pendulum': 0.5,
    'torque_pendulum': 0.3,
    'servo_pendulum': 0.5,
    'double_pendulum': 0.06,
    'xl330_pendulum': 0.4,
}
"""Share of the largest input that runs use."""
EFFECTS = {'viscous_friction': 'b', 'coulomb_friction': 'c', 'armature': 'J'}
"""Effects beside a fault, and the parameter that scales each."""
TAKEN_UP = ('viscous_friction', 'armature')
"""Effects that uncertain constants of a motor do as well: none is missing then."""
SECONDS = 20.0
SIZES = {
    'speed_scale': lambda m, run: (1 + 0.04 * m) ** run.sign,
    'speed_sign': lambda m, run: -1.0,
    'speed_zero': lambda m, run: run.sign * 0.025 * m * run.speed,
    'speed_late': lambda m, run: m * max(0.003, 0.7 * run.period),
    'speed_filter': lambda m, run: m * max(0.003, 0.7 * run.period),
    'angle_scale': lambda m, run: (180 / np.pi) if m > 5 else 1.3 + 0.3 * m,
    'time_stretch': lambda m, run: (1.25 + 0.02 * m) ** run.sign,
    'input_scale': lambda m, run: (8.0 + m) ** run.sign,
    'input_sign': lambda m, run: -1.0,
    'input_late': lambda m, run: 0.15 + 0.005 * m if run.sign > 0 else -0.08 - 0.005 * m,
    'angle_zero': lambda m, run: run.sign * min(1.2 + 0.1 * m, np.pi),
    'frozen': lambda m, run: 0.15 + 0.05 * m,
    'clipped': lambda m, run: run.speed * max(1.3 - 0.02 * m, 0.7),
    'repeated': lambda m, run: min(0.06 + 0.02 * m, 0.6),
    'quantised': lambda m, run: min(0.03 + 0.01 * m, 0.08) * min(run.span, 3.0),
    'goal_as_angle': lambda m, run: 1.0,
}
"""Size of each fault from its multiple m of what just shows, 1 to 30."""
OF_TORQUES = (
    'angle_zero',
    'input_scale',
    'input_sign',
    'input_late',
    'angle_scale',
    'time_stretch',
)
"""Not drawn for robots that take positions: their servo's torque is not logged."""
OF_SENSORS = ('repeated', 'quantised', 'frozen', 'clipped', 'goal_as_angle')
"""They come after the noise."""
COUNT = 2 * np.pi / 4096
"""rad: of an encoder of 12 bits."""


@dataclass(frozen=True)
class Drawn:
    """What a run is like: period [s], rms speed [rad/s], range [rad], and a sign to draw with."""

    period: float
    speed: float
    span: float
    sign: float


def run_case(seed: int, kind: str) -> dict:
    """Draw a log, look for its fault, judge what was found; one line of the results file.

    Args:
        seed: of everything drawn.
        kind: 'fault', or 'sound' for a log without one.
    """
    rng = np.random.default_rng([seed, kind == 'fault'])
    robot = load_robot(str(rng.choice([*ROBOTS])))
    effect = _effect(robot, rng)
    clean, period = _run(robot, effect, rng)
    name, value, log = (
        ('', 0.0, _measured(clean, period, rng))
        if kind == 'sound'
        else _spoilt(clean, robot, period, rng)
    )
    began = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        recording = read_bag(write_runs(Path(folder) / 'bag', runs_of(log), {}), robot)
        found = find_faults([recording], Model(robot))
        seconds = time.process_time() - began
        mended = None if effect is None else effect.effect.name in _named(recording, robot)
    return {
        'kind': kind,
        'seed': seed,
        'robot': robot.name,
        'engine': 'rigid',
        'period': period,
        'beside': effect.effect.name if effect else None,
        'effects': [_hidden(name, value, robot.actuators[0].joint)] if name else [],
        'verdict': 'fault' if _sure(found) else 'fine',
        'named': [[f.code, f.joint] for f in found],
        'found': [
            {k: f.to_json()[k] for k in ('name', 'value', 'ci95', 'sure')}
            | {'worst': f.worst, 'otherwise': len(f.otherwise)}
            for f in found
        ],
        'read': [w.split(': ', 1)[-1] for w in recording.warnings],
        'seconds': seconds,
        'errors': [_error(name, value, f) for f in found if f.code == name][:1],
        'right': bool(found) and found[0].code == name if name else not _sure(found),
        'mended': mended,
    }


def _sure(found: Sequence[Found]) -> bool:
    return any(f.error for f in found)


def _hidden(name: str, value: float, joint: str) -> dict:
    """A fault as lines of results have a hidden effect."""
    units = {'value': FAULTS[name].unit}
    return {'name': name, 'where': joint, 'parameters': {'value': value}, 'units': units}


def _error(name: str, value: float, found: Found) -> dict:
    """How far off its size is, and whether the interval holds it, where it has one."""
    low, high = (end + sign * found.worst for end, sign in zip(found.ci95, (-1, 1), strict=True))
    turns = (-found.fault.turn, 0.0, found.fault.turn) if np.isfinite(found.fault.turn) else (0.0,)
    sized = low < high and not name.endswith('sign')
    return {
        'parameter': name,
        'error': min(abs(found.value - value - turn) for turn in turns) / max(abs(value), 1e-12),
        'inside': any(low <= value + turn <= high for turn in turns) if sized else None,
    }


def _effect(robot: Robot, rng: np.random.Generator) -> Placed | None:
    if rng.uniform() < 0.5:
        return None
    vague = any(c.uncertain for c in robot.constants.values())
    name = str(rng.choice([e for e in EFFECTS if not (vague and e in TAKEN_UP)]))
    joint = robot.actuators[0]
    usual = {'viscous_friction': 0.02, 'coulomb_friction': 0.03, 'armature': 0.0}[name]
    reach = joint.torque_constant or 1.0
    strong = {
        'voltage': joint.limit * reach / (joint.resistance or 1.0),
        'torque': joint.limit,
        'position': 0.5,
    }[robot.input]
    size = usual * strong * rng.uniform(1, 4)
    if name == 'armature':
        size = 0.15 * strong / 30.0 * rng.uniform(0.5, 1)
    return place(robot, name, joint.joint, **{EFFECTS[name]: size})


def _run(robot: Robot, effect: Placed | None, rng: np.random.Generator) -> tuple[Recording, float]:
    """A run at 1 kHz without noise, and the period it will be sampled with."""
    count, period = round(SECONDS / FINE), float(rng.choice([0.005, SLOWEST]))
    hold = round(rng.uniform(0.15, 0.5) / SLOWEST) * round(SLOWEST / FINE)
    level = ROBOTS[robot.name] * np.array([a.limit for a in robot.actuators])
    index = np.arange(count) // hold
    u = (level * rng.uniform(-1, 1, (index[-1] + 1, len(level))))[index]
    model = Model(robot, (effect,) if effect else ())
    start = model.start('nominal')
    q, dq = rollout(model, start.q[None], start.dq[None], u[None], FINE)
    t = np.arange(count, dtype=float) * FINE
    e = Episode(t, q[0][:count], dq[0][:count], u, np.ones(u.shape, dtype=bool))
    names = tuple(robot.joint_names), tuple(a.joint for a in robot.actuators)
    return Recording(Path('simulated'), '', *names, robot.input, period, (e,), {}), period


def _spoilt(
    clean: Recording, robot: Robot, period: float, rng: np.random.Generator
) -> tuple[str, float, Recording]:
    """The run with one fault of its first actuated joint."""
    joint = clean.joints.index(clean.actuators[0])
    e = clean.episodes[0]
    run = Drawn(
        period,
        float(e.dq[:, joint].std()),
        float(np.ptp(e.q[:, joint])),
        float(rng.choice([-1, 1])),
    )
    names = [
        n
        for n in SIZES
        if (n == 'goal_as_angle') <= (robot.input == 'position')
        and not (robot.input == 'position' and n in OF_TORQUES)
    ]
    name = str(rng.choice(names))
    value = float(SIZES[name](float(np.exp(rng.uniform(0, np.log(30)))), run))
    base = _measured(clean, period, rng) if name in OF_SENSORS else clean
    spoilt = replace(base, episodes=(spoil(name, base.episodes[0], joint, 0, value),))
    return name, value, spoilt if name in OF_SENSORS else _measured(spoilt, period, rng)


def _sampled(recording: Recording, period: float) -> Recording:
    """Every so many rows of a run at 1 kHz; inputs as means over the rows left out."""
    (e,) = recording.episodes
    every = round(period / FINE)
    if len(e.t) < SECONDS / FINE * 0.9:
        return recording
    count = len(e.t) // every
    inputs = e.inputs[: count * every].reshape(count, every, -1).mean(axis=1)
    rows = slice(0, count * every, every)
    return replace(
        recording, episodes=(Episode(e.t[rows], e.q[rows], e.dq[rows], inputs, e.enabled[rows]),)
    )


def _measured(recording: Recording, period: float, rng: np.random.Generator) -> Recording:
    """Sampled, with noise, in a third of the cases with an encoder of 12 bits as well."""
    sampled = _sampled(recording, period)
    (e,) = sampled.episodes
    kind = int(rng.integers(3))
    noise = [(1e-3, 0.05), (4e-4, 0.01), (1e-4, 0.02)][kind]
    q = e.q + rng.normal(0, noise[0], e.q.shape)
    q = COUNT * np.round(q / COUNT) if kind == 2 else q
    dq = e.dq + rng.normal(0, noise[1], e.dq.shape)
    return replace(sampled, episodes=(replace(e, q=q, dq=dq),))


def _named(recording: Recording, robot: Robot) -> list[str]:
    """The effects that `leo explain --mend` names."""
    return [e['name'] for e in explain([recording], Model(robot), mend=True).effects]
