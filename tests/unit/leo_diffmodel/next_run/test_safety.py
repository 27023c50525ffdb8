# SPDX-License-Identifier: Apache-2.0
"""What leo next proposes stays off the stops and slow enough, whichever open answer is true."""

from types import SimpleNamespace

import numpy as np
import pytest

from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.next_run.menu import menu, walker_menu
from leo_diffmodel.next_run.reach import Reach, Seen, seen
from leo_diffmodel.next_run.run_file import Run
from leo_diffmodel.next_run.safety import of_answers, room, tamed, values
from leo_diffmodel.next_run.settings import NEXT
from leo_diffmodel.next_run.simulate import simulate
from leo_sim.description.robot import load_robot, Robot
from leo_sim.model import Model

FRICTION = {'pendulum': 0.001}  # of a robot that 0.02 N m would hold still [N m].
SECONDS = 4.0
ROBOTS = [
    *(
        (name, seed)
        for name in ('pendulum', 'double_pendulum', 'xl330_pendulum')
        for seed in (1, 2)
    ),
    *(('servo_pendulum', 1), ('torque_pendulum', 2), ('leo', 1)),
    *(('so101', seed) for seed in (1, 2, 3)),
]


def drawn(robot: Robot, seed: int) -> tuple[list[Model], Model]:
    """What is possible while two answers are open, each with its error, and the truth."""
    rng = np.random.default_rng(seed)
    model = Model(robot, engine='rigid', scheme='search')
    joint = str(rng.choice([a.joint for a in robot.actuators]))
    known = {c.label: c for c in candidates(model)}
    friction = FRICTION.get(robot.name, 0.02)
    sizes = {'voltage_scale': (0.85, 0.05), 'coulomb_friction': (friction, friction / 4)}
    fits = []
    for name, (value, sd) in sizes.items():
        hypothesis = Hypothesis((known[f'{name}:{joint}'],))
        fits.append(Fit(hypothesis, np.array([value]), np.array([[sd**2]]), *np.zeros((5, 0))))
    possible = of_answers([SimpleNamespace(fits=tuple(fits))], model)
    true = fits[int(rng.integers(2))]
    off = rng.uniform(-2.0, 2.0) * true.standard_errors
    return possible, true.hypothesis.model(model, true.theta + off)


def been_through(truth: Model, seed: int) -> Seen:
    """What a first bag shows: steps to a third of what the robot can."""
    robot, rng = truth.robot, np.random.default_rng(seed)
    low, high = robot.bounds
    held = np.repeat(rng.uniform(-0.3, 0.3, (8, len(low))), 50, axis=0)
    middle = 0.5 * (low + high) if robot.input == 'position' else 0.0
    start = 'hanging' if robot.base_joints else ''
    run = Run('first', '', middle + held * (high - low) / 2, np.ones(len(held), bool), start)
    return seen(simulate([run], truth, 1 / robot.state_rate), 1 / robot.state_rate)


@pytest.mark.parametrize(('name', 'seed'), ROBOTS)
def test_a_run_is_safe_with_the_answer_that_is_true(name, seed):
    robot = load_robot(name)
    possible, truth = drawn(robot, seed)
    before = been_through(truth, seed)
    make = walker_menu if robot.base_joints else menu
    runs = [r for r in make(robot, before.allowed(robot), SECONDS) if isinstance(r, Run)]
    runs = runs[:: 5 if robot.base_joints else 1]  # what walks is expensive
    mild, unsafe = tamed(runs, possible, before)
    sent = [run for run, why in zip(mild, unsafe, strict=True) if why is None]
    assert len(sent) > len(runs) / 2
    low, high = robot.bounds
    margin = NEXT.margin * (high - low) * (robot.input == 'position')
    for run, track in zip(sent, simulate(sent, truth, before.period), strict=True):
        assert np.all(run.inputs >= np.minimum(low + margin, run.inputs[0]) - 1e-9)
        assert np.all(run.inputs <= np.maximum(high - margin, run.inputs[0]) + 1e-9)
        (episode,) = track.episodes
        least, most = room(robot, episode.q[0], before)
        slack = 0.2 * NEXT.margin * np.where(np.isfinite(most - least), most - least, 0.0)
        assert np.all(episode.q.min(axis=0) >= least - slack), run.name
        assert np.all(episode.q.max(axis=0) <= most + slack), run.name
        assert np.all(np.abs(episode.dq).max(axis=0) <= 1.1 * before.speeds(robot)), run.name


def test_a_run_is_made_milder_for_the_worst_of_what_is_possible():
    robot = load_robot('double_pendulum')
    light = Model(robot, engine='rigid')
    known = {c.label: c for c in candidates(light)}
    braked = Hypothesis((known['viscous_friction:all'],)).model(light, np.array([0.5]))
    before = been_through(braked, 1)
    runs = menu(robot, Reach.of_levels(0.3 * robot.limits), SECONDS)[:3]
    (alone, _), (both, _) = (tamed(runs, m, before) for m in ([braked], [braked, light]))
    for one, other in zip(alone, both, strict=True):
        assert np.abs(other.inputs).max() <= np.abs(one.inputs).max()
    assert np.abs(both[0].inputs).max() < 0.7 * np.abs(alone[0].inputs).max()


def test_the_ends_of_an_answer_lie_along_what_is_least_sure_and_within_its_bounds():
    known = {c.label: c for c in candidates(Model('torque_pendulum', engine='rigid'))}
    pair = Hypothesis((known['viscous_friction:pivot'], known['coulomb_friction:pivot']))
    theta = np.array([0.02, 0.01])
    middle, *ends = values(Fit(pair, theta, np.diag([1e-10, 0.04**2]), *np.zeros((5, 0))))
    np.testing.assert_array_equal(middle, theta)
    ends = np.array(sorted(ends, key=lambda end: end[1]))
    np.testing.assert_allclose(ends[:, 0], 0.02, atol=1e-4)
    np.testing.assert_allclose(ends[:, 1], [0.0, 0.09], atol=1e-9)
    assert values(Fit(Hypothesis(), np.zeros(0), np.zeros((0, 0)), *np.zeros((5, 0))))[0].size == 0
