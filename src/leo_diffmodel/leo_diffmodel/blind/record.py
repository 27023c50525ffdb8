# SPDX-License-Identifier: Apache-2.0
"""Record a case through the simulated driver into a real bag; the bag tells no truth."""

from __future__ import annotations

from pathlib import Path
import tempfile

import yaml

from leo_diffmodel.bags.writer import BagWriter
from leo_diffmodel.blind.case import Case
from leo_msgs_py.values import Applied, JointStates
from leo_msgs_py.wire.types import serialize
from leo_sim.drivers.base import DriverOptions
from leo_sim.drivers.simulated import SimulatedDriver
from leo_sim.model_file import write_effects

RATE = 100.0


def record(case: Case, folder: Path) -> Path:
    """Run the case's robot with its inputs for its 20 s and write what a robot would publish."""
    with tempfile.TemporaryDirectory() as private:
        driver = SimulatedDriver(_options(case, Path(private)))
    writer = BagWriter(folder, {'robot': case.robot.name})
    states = writer.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
    applied = writer.add_topic('/dynamic_joint_states', 'control_msgs/msg/DynamicJointState')
    per_control = round(RATE * case.robot.control_period)
    _write(writer, states, driver.read())
    for value, on in zip(case.run.inputs, case.run.enabled, strict=True):
        driver.set_torque(bool(on.all()))
        _write(writer, applied, driver.write(value))
        for _ in range(per_control):
            driver.advance(1 / RATE)
            _write(writer, states, driver.read())
    writer.close()
    return folder


def _options(case: Case, private: Path) -> DriverOptions:
    hidden = private / 'hidden.yaml'
    hidden.write_text(yaml.safe_dump({'effects': write_effects(case.effects)}))
    return DriverOptions(
        robot=case.run.robot,
        state_rate=RATE,
        seed=case.seed,
        noise=case.run.noise,
        engine=case.engine[0],
        integration_step=case.engine[1],
        private={'hidden': str(hidden)},
    )


def _write(writer: BagWriter, channel: int, value: JointStates | Applied) -> None:
    writer.write(channel, serialize(value.to_message()), value.stamp_ns)
