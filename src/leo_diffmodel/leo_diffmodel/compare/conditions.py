# SPDX-License-Identifier: Apache-2.0
"""Conditions a joint was in: speed, direction, load, angle, input, on or free, phase, time."""

from collections.abc import Iterator
from dataclasses import dataclass
import itertools
import math

import numpy as np

from leo_diffmodel.compare.pushes import own
from leo_diffmodel.compare.settings import COMPARE
from leo_diffmodel.compare.sizes import input_unit, length_unit, torque_unit
from leo_diffmodel.compare.windows import Array, Windows
from leo_sim.description.robot import Robot
from leo_sim.model import Model

FORWARD, BACKWARD, TURNING = 'forward', 'backward', 'still or turning'
ON, FREE = 'on', 'free'
SWING, STANCE, DOUBLE = 'swing', 'stance', 'double support'
TOUCH_DOWN, LIFT_OFF = 'touch-down', 'lift-off'
FLIGHT, SINGLE = 'flight', 'single support'
LYING, HANGING = 'lying', 'hanging'


@dataclass(frozen=True)
class Condition:
    """Windows in which one joint was in one condition."""

    joint: int
    variable: str
    """Speed, direction, load, angle (of a slide: position), turned (the angle with its whole
    turns, where the joint went around), input, motor, phase (of a walker's feet, see `phases`) or
    time."""
    unit: str  # of the bin's ends; empty where the bin is a word
    bin: tuple[float, float] | str  # lowest and highest value, or a word
    inside: Array  # which windows, shape (W,)
    bag: int | None = None  # the recording that a time bin lies in


def conditions(
    windows: Windows, model: Model, most: int = COMPARE.most_bins, pressed: Array | None = None
) -> list[Condition]:
    """Every condition that at least eight windows were in, each window once per variable.

    Motor law and gravity of the model say what a gear carries. `most` is the number of bands of a
    variable; the ground presses on the spheres `pressed`, (W, K+1, P).
    """
    load = carried(windows, model)
    of_feet = None if pressed is None else phases(model.robot, pressed, windows.held)
    found: list[Condition] = []
    for j in range(len(model.robot.joint_names)):
        for name, unit, values in _ranges(windows, model.robot, load, j):
            found += [Condition(j, name, unit, *b) for b in bands(values, most)]
        words = {'direction': _direction(windows, j), 'motor': _motor(windows, model, j)}
        words |= {} if of_feet is None else {'phase': of_feet[j]}
        found += [Condition(j, name, '', *c) for name, w in words.items() for c in _classes(w)]
        found += _time(windows, j, most)
    return [c for c in found if c.inside.sum() >= COMPARE.fewest_in_bin]


def carried(windows: Windows, model: Model) -> Array:
    """Size of the torque that each joint's gear transmits by the model [N m], shape (W, J).

    Motor torque less that of gravity, as in the law of load-dependent friction.
    """
    model = own(model, windows, instants=True)
    laws = model.laws
    q, dq = laws.true_state(windows.q[:, :-1], windows.dq[:, :-1])
    load = np.asarray(model.rigid.load(q))
    torques = laws.torques(q, dq, dq, windows.inputs, windows.enabled > 0.5, load)
    return np.abs(np.asarray(torques.motor) - load).mean(axis=1)


def bands(values: Array, most: int = COMPARE.most_bins) -> list[tuple[tuple[float, float], Array]]:
    """Ranges that hold about equally many values, and which values are in each."""
    count = int(np.clip(len(values) // COMPARE.fewest_in_bin, 1, most))
    edges = np.unique(np.quantile(values, np.linspace(0, 1, count + 1)))
    if len(edges) < 3:
        edges = np.linspace(values.min(), values.max(), 3)
    index = np.clip(np.searchsorted(edges, values, side='right') - 1, 0, len(edges) - 2)
    ends = enumerate(itertools.pairwise(edges))
    return [((float(low), float(high)), index == b) for b, (low, high) in ends]


def _ranges(
    windows: Windows, robot: Robot, load: Array, j: int
) -> Iterator[tuple[str, str, Array]]:
    name = robot.joint_names[j]
    yield 'speed', f'{length_unit(robot, name)}/s', np.abs(windows.dq[..., j].mean(axis=1))
    yield 'load', torque_unit(robot, name), load[:, j]
    q = windows.q[..., j].mean(axis=1)
    if name in robot.slides:
        yield 'position', 'm', q
    else:
        yield 'angle', 'rad', folded(q)
        if np.ptp(q) > math.tau:
            yield 'turned', 'rad', q
    if j in robot.actuated:
        values = windows.inputs[..., robot.actuated.index(j)].mean(axis=1)
        if np.ptp(values) > 0:
            yield 'input', input_unit(robot, name), values


def folded(angle: Array) -> Array:
    """Angles as they are, or within (-pi, pi] where the joint went around [rad]."""
    return angle if np.ptp(angle) <= math.tau else (angle + np.pi) % math.tau - np.pi


def _direction(windows: Windows, j: int) -> Array:
    """Forward or backward where every rate of a window has one sign, shape (W,) of words."""
    rates = windows.dq[..., j]
    forward, backward = (rates > 0).all(axis=1), (rates < 0).all(axis=1)
    return np.select([forward, backward], [FORWARD, BACKWARD], TURNING)


def _motor(windows: Windows, model: Model, j: int) -> Array:
    """On or free, shape (W,) of words; empty for a joint without a motor."""
    if j not in model.robot.actuated:
        return np.zeros(0, dtype='U4')
    on = windows.enabled[..., model.robot.actuated.index(j)].mean(axis=1) > 0.5
    return np.where(on, ON, FREE)


def _classes(words: Array) -> list[tuple[str, Array]]:
    """Each word and where it stands; nothing where one word says it all."""
    different = np.unique(words)
    return [(str(w), words == w) for w in different] if len(different) > 1 else []


def _time(windows: Windows, j: int, most: int) -> list[Condition]:
    """Stretches of equally many windows, `most` or one a bag; none joins two bags."""
    source, middle = windows.source, windows.start + 0.5 * windows.dt.sum(axis=1)
    bags = np.unique(source)
    each = max(1, most // len(bags))
    found = []
    for bag in bags:
        here = np.flatnonzero(source == bag)
        for part in np.array_split(here, min(each, len(here))):
            inside = np.isin(np.arange(len(source)), part)
            ends = float(middle[part].min()), float(middle[part].max())
            found.append(Condition(j, 'time', 's', ends, inside, int(bag)))
    return found


def carrying(model: Model, states: Array) -> Array:
    """Which spheres of robot.yaml the ground presses on at sensed states (W, K, 2J), (W, K, P)."""
    joints = states.shape[-1] // 2
    true = model.laws.true_state(states[..., :joints], states[..., joints:])
    forces: Array = model.spheres.forces(*true)
    return forces > 0.0


def phases(robot: Robot, pressed: Array, held: Array) -> list[Array]:
    """The phase of each window as each joint sees it: J arrays (W,) of words.

    Joints of one leg see their own foot: swing, stance, double support (the other foot carries
    too), touch-down, lift-off. The others see both feet. All see lying (something other than the
    feet carries) and hanging (the base is held). Spheres are `pressed` (W, K, P), bases `held`
    (W,).
    """
    links = [contact.link for contact in robot.contacts]
    feet = [pressed[..., [link == foot for link in links]].any(axis=-1) for foot in robot.feet]
    on = np.stack(feet, axis=-1)
    elsewhere = pressed[..., [link not in robot.feet for link in links]].any(axis=(1, 2))
    below = [_feet_below(robot, name) for name in robot.joint_names]
    words = [_of_leg(on, feet[0]) if len(feet) == 1 else _of_all(on) for feet in below]
    return [np.where(held, HANGING, np.where(elsewhere, LYING, w)) for w in words]


def _feet_below(robot: Robot, joint: str) -> list[int]:
    moved: set[str] = set()
    for j in robot.joints:
        if j.name == joint or j.parent in moved:
            moved.add(j.child)
    return [index for index, foot in enumerate(robot.feet) if foot in moved]


def _of_leg(on: Array, foot: int) -> Array:
    """Of windows (W, K, feet), as the leg of one foot sees them, (W,)."""
    down, all_feet = on[..., foot], on.all(axis=(1, 2))
    return np.select(
        [all_feet, down.all(axis=1), ~down.any(axis=1), down[:, 0] & ~down[:, -1]],
        [DOUBLE, STANCE, SWING, LIFT_OFF],
        TOUCH_DOWN,
    )


def _of_all(on: Array) -> Array:
    """Of windows (W, K, feet), as the trunk sees them, (W,)."""
    steady, count = (on == on[:, :1]).all(axis=(1, 2)), on.sum(axis=-1)
    first, last = count[:, 0], count[:, -1]
    return np.select(
        [steady & (first == 0), steady & (first == 1), steady, last < first],
        [FLIGHT, SINGLE, DOUBLE, LIFT_OFF],
        TOUCH_DOWN,
    )
