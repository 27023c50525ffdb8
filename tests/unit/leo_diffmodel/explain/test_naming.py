# SPDX-License-Identifier: Apache-2.0
"""Every effect of the catalogue, hidden in either pendulum, is named with its size."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.searched import searched
from tests.simulate import DT, NOISE, PENDULUM, POSITION, record, steps, TORQUE

from leo_diffmodel.explain.problem.classes import Facts, same_thing
from leo_sim.description.robot import Robot
from leo_sim.effects import EFFECTS, place, Placed
from leo_sim.model import Model
from leo_sim.model.batch import rollout
from leo_sim.truth.drawing import of_size

SECONDS, SIZE, SHORT = 8.0, 15.0, 30
MOTOR = {p: replace(c, uncertain=None) for p, c in POSITION.constants.items() if 'offset' not in p}
ROBOTS = {robot.name: robot for robot in (PENDULUM, TORQUE, POSITION.with_constants(MOTOR))}
BY_HAND = {
    ('pendulum', 'stribeck_friction'): {'c': 4e-4, 'c_static': 1.2e-3, 'v_s': 1.0},
    ('pendulum', 'voltage_limit'): {'v': 1.2},
    ('torque_pendulum', 'stribeck_friction'): {'c': 0.15, 'c_static': 0.45, 'v_s': 1.0},
    ('torque_pendulum', 'voltage_limit'): {'v': 1.2},
    ('pendulum', 'warming_friction'): {'c': 4e-4, 'c_start': 1.2e-3, 'T': 3.0},
    ('torque_pendulum', 'warming_friction'): {'c': 0.15, 'c_start': 0.45, 'T': 3.0},
    ('pendulum', 'torque_fade'): {'s': 0.4, 'T': 3.0},
    ('torque_pendulum', 'torque_fade'): {'s': 0.4, 'T': 3.0},
    ('pendulum', 'smooth_friction'): {'c': 1e-3, 'v_0': 1.0},
    ('torque_pendulum', 'smooth_friction'): {'c': 0.4, 'v_0': 1.0},
    ('pendulum', 'backlash'): {'gap': 0.3},
    ('torque_pendulum', 'backlash'): {'gap': 0.5},
    ('torque_pendulum', 'velocity_lag'): {'tau': 0.03},
    ('pendulum', 'late_payload'): {'m': 0.02, 'x': 0.01, 'z': 0.03, 't0': 3.7},
    ('torque_pendulum', 'late_payload'): {'m': 0.2, 'x': 0.1, 'z': -0.4, 't0': 3.7},
    ('xl330_pendulum', 'goal_rate'): {'rate': 6.0},
    ('xl330_pendulum', 'goal_acceleration'): {'a': 60.0},
}


def cases() -> Iterator[Any]:
    """Every effect on each robot that shows it; slow on all but one of them, taken in turns.

    On the servo only what acts on its loop.
    """
    for number, (name, effect) in enumerate(EFFECTS.items()):
        applies = [robot.name for robot in ROBOTS.values() if effect.applies(robot)]
        others = [robot for robot in applies if robot != POSITION.name]
        robots = [] if effect.together else others or applies
        for turn, robot in enumerate(robots):
            marks = [] if turn == number % len(robots) else [pytest.mark.slow]
            yield pytest.param(robot, name, number, marks=marks)


class Shown:
    """Change of 0.3 s runs along the ideal robot's own track, in measurement noises."""

    def __init__(self, robot: Robot, inputs: np.ndarray):
        self.robot, count = robot, len(inputs) // SHORT
        (track,) = record(robot, inputs=inputs, noise=(0.0, 0.0)).episodes
        self._start = track.q[::SHORT][:count], track.dq[::SHORT][:count]
        self._inputs = inputs[: count * SHORT].reshape(count, SHORT, -1)
        self._ideal = self._run(())

    def size(self, placed: Placed) -> np.ndarray:
        both = zip(self._run((placed,)), self._ideal, NOISE, strict=True)
        changes = [(new - old) / sigma for new, old, sigma in both]
        with np.errstate(over='ignore'):
            return np.sqrt((np.concatenate(changes, axis=-1) ** 2).mean(axis=(-3, -2, -1)))

    def _run(self, effects: tuple[Placed, ...]) -> tuple[np.ndarray, np.ndarray]:
        return rollout(Model(self.robot, effects), *self._start, self._inputs, DT)


def hidden(robot: Robot, name: str, number: int) -> Placed:
    """The effect in a size that is clear but far from absurd."""
    (where, *_) = EFFECTS[name].places(robot)
    if (robot.name, name) in BY_HAND:
        return place(robot, name, where, **BY_HAND[robot.name, name])
    shown = Shown(robot, steps(robot, SECONDS, number))
    found = of_size(shown, name, where, SIZE, np.random.default_rng(number))  # type: ignore
    assert found is not None
    return found


@pytest.mark.parametrize(('robot', 'name', 'number'), list(cases()))
def test_it_is_named(robot, name, number):
    """Single effects on a bag with the effect; every third from another integrator."""
    robot, other = ROBOTS[robot], {'engine': 'rk4', 'integration_step': 0.0019}
    truth, other = hidden(robot, name, number), {} if number % 3 else other
    data = [record(robot, truth, seconds=SECONDS, seed=number, **other)]
    found, facts = searched(data, Model(robot)), Facts(robot, ever_free=False)
    top, *_ = found.final.hypothesis.candidates
    if top.effect.name != name:
        right = next(c for s in found.sets for c in s.names if c.effect.name == name)
        assert same_thing(top, right, facts)
        return
    for index, (parameter, value) in enumerate(truth.parameters.items()):
        low, high = found.final.ci95(index)
        found_value = found.final.theta[index]
        margin = max(1.5 * (high - low), 0.1 * abs(value))
        assert abs(found_value - value) <= margin, (parameter, value, found_value)
