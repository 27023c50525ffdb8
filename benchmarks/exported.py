# SPDX-License-Identifier: Apache-2.0
"""What exported files cost (docs/export.md): bags of robots with known effects, all formats.

Each robot is a simulated one (Runge-Kutta 4, noise) with the effects of the model that is
exported. `python benchmarks/exported.py [ROBOT…]`
"""

from pathlib import Path
import sys
import tempfile
from typing import Any

import numpy as np
import yaml

from leo_diffmodel.bags.recording import read_bag, Recording
from leo_diffmodel.bags.types import APPLIED, STATES
from leo_diffmodel.bags.writer import BagWriter
from leo_diffmodel.exported.check import check
from leo_learner.verbs.demo import ROBOT, SHIPPED
from leo_msgs_py.cdr import joint_state
from leo_sim.drivers.base import DriverOptions, INTERFACES
from leo_sim.drivers.simulated import SimulatedDriver
from leo_sim.effects import place, Placed
from leo_sim.export.files import export
from leo_sim.export.formats import FORMATS
from leo_sim.model import Model
from leo_sim.model.model_file import write_effects

SECONDS, HOLD = 20.0, 0.4
RUBS = ('viscous_friction', 'all', {'b': 0.01}), ('coulomb_friction', 'all', {'c': 0.02})
CASES: dict[str, tuple[Any, float, float, tuple[float, float]]] = {
    'servo_pendulum': ((*RUBS, ('back_emf_scale', 'all', {'k': 1.2})), 0.5, 0.01, (1e-3, 0.02)),
    'xl330_pendulum': (RUBS, 0.35, 0.01, (1e-3, 0.02)),
    'double_pendulum': (
        (
            ('viscous_friction', 'all', {'b': 0.02}),
            ('coulomb_friction', 'all', {'c': 0.05}),
            ('link_mass', 'lower', {'m': 0.2}),
        ),
        0.3,
        0.01,
        (1e-3, 0.02),
    ),
    'so101': (
        (('link_mass', 'gripper_link', {'m': 0.2}), ('coulomb_friction', 'all', {'c': 0.05})),
        0.35,
        0.02,
        (5e-4, 0.01),
    ),
}
"""By robot: effects, share of the inputs' range, control period s, noise in rad and rad/s."""


def modelled(name: str) -> Model:
    """The model that is exported."""
    if name == ROBOT:  # what the recording of the demo hides
        found = Model(ROBOT)
        return found.changed(effects=[place(found.robot, 'link_mass', 'bob', m=1.676)])
    found = Model(name)
    return found.changed(effects=[place(found.robot, e, w, **p) for e, w, p in CASES[name][0]])


def commands(model: Model, share: float, period: float) -> np.ndarray:
    """Steps of random size; goals go straight from one to the next."""
    robot = model.robot
    count, hold = round(SECONDS / period), round(HOLD / period)
    steps = np.random.default_rng(5).uniform(-1, 1, (count // hold + 1, len(robot.actuators)))
    if robot.input != 'position':
        repeated = np.repeat(steps, hold, axis=0)[:count]
        return np.asarray(share * repeated * np.abs(robot.bounds).min(axis=0))
    (low, high), at = robot.bounds, np.arange(len(steps)) * hold
    goals = share * steps * (high - low) / 2 + (high + low) / 2
    return np.stack([np.interp(np.arange(count), at, goal) for goal in goals.T], axis=1)


def recorded(folder: Path, model: Model, effects: tuple[Placed, ...]) -> Recording:
    """A bag of a robot that hides the effects."""
    robot = model.robot
    _, share, period, noise = CASES[robot.name]
    hidden = folder / 'hidden.yaml'
    hidden.write_text(yaml.safe_dump({'effects': write_effects(effects)}))
    private = {'hidden': str(hidden)}
    driver = SimulatedDriver(DriverOptions(robot, noise=noise, engine='rk4', private=private))
    interface = INTERFACES[robot.input]
    bag = BagWriter(folder / 'bag')
    states, applied = (bag.add_topic(*topic) for topic in (STATES, APPLIED[interface]))
    field = 'position' if interface == 'position' else 'effort'
    for given in commands(model, share, period):
        seen, sent = driver.read(), driver.write(given)
        now, values = seen.stamp_ns, {field: sent.nan_where_free}
        bag.write(states, joint_state(now, seen.names, seen.position, seen.velocity), now)
        bag.write(applied, joint_state(now, sent.names, **values), now)
        driver.advance(period)
    bag.close()
    return read_bag(folder / 'bag', robot)


def main(names: list[str]) -> None:
    """Print one line for each robot and format."""
    for name in names or [ROBOT, *CASES]:
        model = modelled(name)
        with tempfile.TemporaryDirectory() as folder:
            recording = (
                read_bag(SHIPPED / 'bag', model.robot)
                if name == ROBOT
                else recorded(Path(folder), model, model.effects)
            )
        for format_ in FORMATS.values():
            made = export(model, name, format_, Path('arm.xml'))
            text = made.texts[Path('arm.xml')] if format_.name == 'MJCF' else None
            found = check([recording], model, made.held.simulated, text)['by_unit']
            ratios = {
                what: [round(found[what][u] / found['ours'][u] - 1, 5) for u in found['ours']]
                for what in ('reduced', 'exported')
                if what in found
            }
            print(f'{name}, {format_.name}: errors beside the model {ratios}', flush=True)


if __name__ == '__main__':
    main(sys.argv[1:])
