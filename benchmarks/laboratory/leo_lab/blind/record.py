# SPDX-License-Identifier: Apache-2.0
"""Record a case through the simulated driver into real bags; they tell no truth."""

from __future__ import annotations

from pathlib import Path
import tempfile

import yaml

from leo_diffmodel.bags.types import APPLIED, EPISODE, STATES
from leo_diffmodel.bags.writer import BagWriter
from leo_lab.blind.case import Case
from leo_lab.blind.pushed_driver import PushedDriver
from leo_lab.blind.scenes import Scene
from leo_lab.blind.sensing import Sensor
from leo_msgs_py import cdr
from leo_msgs_py.values import Applied, field_of, JointStates
from leo_sim.drivers.base import DriverOptions
from leo_sim.drivers.simulated import SimulatedDriver
from leo_sim.model.model_file import write_effects

RATE = 100.0
APART = 1_000_000
"""Between the seeds of one scene's noise and the next's."""


def record(case: Case, folder: Path) -> list[Path]:
    """Run the case's robot through its scenes and write what a robot would publish, a bag each."""
    bags = []
    for number, scene in enumerate(case.run.scenes):
        with tempfile.TemporaryDirectory() as private:
            options = _options(case, number, Path(private))
            driver = (
                PushedDriver(options, case.pushes) if case.pushes else SimulatedDriver(options)
            )
        sensor = Sensor(case.sensing, case.seed + APART * number)
        bags.append(_recorded(driver, sensor, scene, case, folder / f'bag_{number}'))
    return bags


def _recorded(
    driver: SimulatedDriver, sensor: Sensor, scene: Scene, case: Case, folder: Path
) -> Path:
    writer = BagWriter(folder, {'robot': case.robot.name, 'held': str(scene.held).lower()})
    topics = STATES, APPLIED[driver.info.interface], EPISODE
    states, applied, episode = (writer.add_topic(*topic) for topic in topics)
    per_control, step = round(RATE * case.robot.control_period), scene.begin()

    def begin() -> None:
        sensor.begin()
        writer.write(episode, cdr.uint32(1 + driver.starts), driver.read().stamp_ns)
        publish()

    def publish() -> None:
        seen = driver.read()
        shown = sensor.published(seen)
        if shown is not None:
            writer.write(states, _measured(shown), seen.stamp_ns)

    begin()
    for k in range(scene.count):
        seen = driver.read()
        driven = step(k, seen.position, seen.velocity)
        if driven is None:
            driver.reset()
            begin()
            continue
        inputs, on = driven
        driver.set_torque(bool(on.all()))
        writer.write(applied, _sent(driver.write(inputs)), seen.stamp_ns)
        for _ in range(per_control):
            driver.advance(1 / RATE)
            publish()
    writer.close()
    return folder


def _options(case: Case, number: int, private: Path) -> DriverOptions:
    hidden = private / 'hidden.yaml'
    hidden.write_text(yaml.safe_dump({'effects': write_effects((*case.effects, *case.small))}))
    return DriverOptions(
        robot=case.run.robot,
        state_rate=RATE,
        seed=case.seed + APART * number,
        noise=case.sensing.noise or case.run.noise,
        start=case.run.scenes[number].start,
        engine=case.engine[0],
        integration_step=case.engine[1],
        private={'hidden': str(hidden)},
    )


def _measured(seen: JointStates) -> bytes:
    return cdr.joint_state(seen.stamp_ns, seen.names, seen.position, seen.velocity)


def _sent(applied: Applied) -> bytes:
    values = {field_of(applied.interface): applied.nan_where_free}
    return cdr.joint_state(applied.stamp_ns, applied.names, **values)
