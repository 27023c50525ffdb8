# SPDX-License-Identifier: Apache-2.0
"""The robots that ship with the package: one folder each, named in the group leo.robots."""

from pathlib import Path

PENDULUM = Path(__file__).parent / 'pendulum'
TORQUE_PENDULUM = Path(__file__).parent / 'torque_pendulum'
SERVO_PENDULUM = Path(__file__).parent / 'servo_pendulum'
XL330_PENDULUM = Path(__file__).parent / 'xl330_pendulum'
SO101 = Path(__file__).parent / 'so101'
DOUBLE_PENDULUM = Path(__file__).parent / 'double_pendulum'
LEO = Path(__file__).parent / 'leo'
LEO_ODE = Path(__file__).parent / 'leo_ode'
