# SPDX-License-Identifier: Apache-2.0
"""Record a case through the simulated driver into real bags; they tell no truth."""

from __future__ import annotations

from pathlib import Path
import tempfile

import yaml

from leo_diffmodel.bags.types import DYNAMIC_JOINT_STATE, JOINT_STATE, UINT32
from leo_diffmodel.bags.writer import BagWriter
from leo_diffmodel.blind.case import Case
from leo_diffmodel.blind.scenes import Scene
from leo_msgs_py import topics
from leo_msgs_py.messages import UInt32
from leo_msgs_py.values import Applied, JointStates
from leo_msgs_py.wire.types import serialize
from leo_sim.drivers.base import DriverOptions
from leo_sim.drivers.simulated import SimulatedDriver
from leo_sim.model_file import write_effects

TOPICS = (
    (topics.JOINT_STATES, JOINT_STATE),
    (topics.DYNAMIC_JOINT_STATES, DYNAMIC_JOINT_STATE),
    (topics.EPISODE, UINT32),
)
RATE = 100.0
APART = 1_000_000
"""Between the seeds of one scene's noise and the next's."""


def record(case: Case, folder: Path) -> list[Path]:
    """Run the case's robot through its scenes and write what a robot would publish, a bag each."""
    bags = []
    for number, scene in enumerate(case.run.scenes):
        with tempfile.TemporaryDirectory() as private:
            driver = SimulatedDriver(_options(case, number, Path(private)))
        bags.append(_recorded(driver, scene, case, folder / f'bag_{number}'))
    return bags


def _recorded(driver: SimulatedDriver, scene: Scene, case: Case, folder: Path) -> Path:
    writer = BagWriter(folder, {'robot': case.robot.name, 'held': str(scene.held).lower()})
    states, applied, episode = (writer.add_topic(f'/{t.name}', type_) for t, type_ in TOPICS)
    per_control, step = round(RATE * case.robot.control_period), scene.begin()

    def begin() -> None:
        seen = driver.read()
        number = serialize(UInt32(data=1 + driver.starts))
        writer.write(episode, number, seen.stamp_ns)
        _write(writer, states, seen)

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
        _write(writer, applied, driver.write(inputs))
        for _ in range(per_control):
            driver.advance(1 / RATE)
            _write(writer, states, driver.read())
    writer.close()
    return folder


def _options(case: Case, number: int, private: Path) -> DriverOptions:
    hidden = private / 'hidden.yaml'
    hidden.write_text(yaml.safe_dump({'effects': write_effects(case.effects)}))
    return DriverOptions(
        robot=case.run.robot,
        state_rate=RATE,
        seed=case.seed + APART * number,
        noise=case.run.noise,
        start=case.run.scenes[number].start,
        engine=case.engine[0],
        integration_step=case.engine[1],
        private={'hidden': str(hidden)},
    )


def _write(writer: BagWriter, channel: int, value: JointStates | Applied) -> None:
    writer.write(channel, serialize(value.to_message()), value.stamp_ns)
