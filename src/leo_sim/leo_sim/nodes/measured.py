# SPDX-License-Identifier: Apache-2.0
"""Topics of what hardware measures besides angles: supply, currents, temperatures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import BatteryState, JointState, Temperature
from std_msgs.msg import Header

from leo_msgs_py import topics
from leo_msgs_py.values import time_message
from leo_sim.drivers.base import Instrumented


class MeasuredTopics:
    """Publishes the readings of a driver: supply and currents with each state, the rest slowly.

    Args:
        node: whose topics they are.
        actuators: joint names, in the order of the readings.
        driver: what measures.
    """

    def __init__(self, node: Node, actuators: tuple[str, ...], driver: Instrumented) -> None:
        self._driver, self._actuators = driver, actuators
        self._supply = node.create_publisher(*topics.SUPPLY)
        self._current = node.create_publisher(*topics.CURRENT)
        self._temperature = node.create_publisher(*topics.TEMPERATURE)
        self._stamp_ns = 0

    def publish(self, stamp_ns: int) -> None:
        """Supply [V] and currents [A] of the state with this stamp."""
        self._stamp_ns = stamp_ns
        if (found := self._driver.readings()) is None:
            return
        header = self._header()
        drawn = np.nan if found.current is None else float(np.abs(found.current).sum())
        self._supply.publish(
            BatteryState(
                header=header,
                voltage=found.supply,
                current=-drawn,
                charge=np.nan,
                capacity=np.nan,
                design_capacity=np.nan,
                percentage=np.nan,
                temperature=np.nan,
                present=True,
            )
        )
        if found.current is not None:
            self._current.publish(
                JointState(
                    header=header, name=list(self._actuators), effort=found.current.tolist()
                )
            )

    def publish_temperatures(self) -> None:
        """One message [deg C] per actuator."""
        found = self._driver.readings()
        if found is None or found.temperature is None:
            return
        for joint, value in zip(self._actuators, found.temperature, strict=True):
            self._temperature.publish(
                Temperature(header=self._header(joint), temperature=float(value))
            )

    def figures(self) -> Mapping[str, str]:
        """What the driver tells, and what is wrong with actuators."""
        return self._driver.figures()

    def alarm(self) -> str:
        """What is wrong with actuators, nothing where all is well."""
        found = self._driver.readings()
        if found is None:
            return ''
        named = zip(self._actuators, found.condition, strict=False)
        return '; '.join(f'{joint}: {what}' for joint, what in named if what)

    def _header(self, frame: str = '') -> Header:
        return Header(stamp=time_message(self._stamp_ns), frame_id=frame)
