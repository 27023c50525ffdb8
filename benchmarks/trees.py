# SPDX-License-Identifier: Apache-2.0
"""CPU time of the trees that can serve one robot, side by side: steps, and batches of windows."""

from collections.abc import Callable
import time

import numpy as np

from leo_sim.description.robot import load_robot, Robot
from leo_sim.dynamics.spatial import Single, Spatial
from leo_sim.effects import place
from leo_sim.effects.base import Placed
from leo_sim.model import Model, rollout

ROUNDS, WINDOWS, STEPS, PERIOD = 7, 40, 15, 0.03
BODIES = {'pendulum': (Single, Spatial)}


def model_of(robot: Robot, body: type, effects: tuple[Placed, ...]) -> Model:
    """A model whose tree is of another kind than it would choose."""
    model = Model(robot, effects, engine='rigid')
    model.__dict__['rigid'] = body(robot.joints, model.laws.bodies, model.laws.gravity)
    return model


def steps(model: Model) -> np.ndarray:
    state = model.start()
    for _ in range(STEPS):
        state = model.step(state, 0.3 * model.robot.limits, PERIOD)
    return state.q


def batch(model: Model) -> np.ndarray:
    rng, size = np.random.default_rng(1), (WINDOWS, len(model.robot.joint_names))
    inputs = rng.uniform(-0.5, 0.5, (WINDOWS, STEPS, len(model.robot.actuators)))
    start = model.start().q + 0.1 * rng.standard_normal(size)
    angles: np.ndarray = rollout(
        model, start, 0.1 * rng.standard_normal(size), inputs * model.robot.limits, PERIOD
    )[0]
    return angles


def cost(run: Callable[[Model], np.ndarray], model: Model) -> tuple[float, np.ndarray]:
    """The least CPU time of several runs, s, and what they give; the first one compiles."""
    result, times = run(model), []
    for _ in range(ROUNDS):
        start = time.process_time()
        run(model)
        times.append(time.process_time() - start)
    return min(times), result


def main() -> None:
    for name, bodies in BODIES.items():
        robot = load_robot(name)
        friction = place(robot, 'coulomb_friction', 'all', c=0.01)
        for effects in ((), (friction,)):
            for run in (steps, batch):
                found = {b.__name__: cost(run, model_of(robot, b, effects)) for b in bodies}
                least, first = found[bodies[0].__name__]
                print(name, 'with friction' if effects else 'plain', run.__name__)
                for kind, (t, q) in found.items():
                    off = np.abs(q - first).max()
                    print(f'  {kind}: {1e3 * t:.2f} ms, {t / least:.2f} of the first; {off:.0e}')


if __name__ == '__main__':
    main()
