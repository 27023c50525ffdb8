# SPDX-License-Identifier: Apache-2.0
"""The schema of robot.yaml."""
from typing import Annotated, Literal

from pydantic import Field

from leo_sim.yaml_file import Finite, Positive, Quantity, Schema

Drawn = Finite | tuple[Finite, Finite]


class ActuatorFile(Schema):
    """Figures of an actuator, all at the joint side of its gear."""

    limit: Quantity
    torque_constant: Quantity | None = None
    resistance: Quantity | None = None
    supply: Quantity | None = None
    rotor_inertia: Quantity | None = None


class LinkFile(Schema):
    """Inertial figures that override the URDF; inertia = about the CoM along the joint axis."""

    mass: Quantity | None = None
    com_x: Quantity | None = None
    com_y: Quantity | None = None
    com_z: Quantity | None = None
    inertia: Quantity | None = None


class JointFile(Schema):
    """Passive figures of a joint that override the URDF."""

    damping: Quantity | None = None


class PoseFile(Schema):
    """A start pose: values, or [low, high] to draw from; joints left out start at 0."""

    angles: dict[str, Drawn] = Field(default_factory=dict)
    rates: dict[str, Drawn] = Field(default_factory=dict)
    held: bool = False


class SensorFile(Schema):
    """A joint's encoder: resolution (0 = not quantised), and what it reads at angle 0."""

    angle_resolution: Annotated[Finite, Field(ge=0)] = 0.0
    rate_resolution: Annotated[Finite, Field(ge=0)] = 0.0
    offset: Quantity | None = None


class ObservedFile(Schema):
    """One number of the observation."""

    quantity: Literal['angle', 'wrapped_angle', 'cos', 'sin', 'rate']
    joint: str


class RewardFile(Schema):
    """A term of the reward: weight (quantity - target)^power after the step."""

    quantity: Literal['angle', 'wrapped_angle', 'cos', 'sin', 'rate', 'input']
    joint: str
    weight: Finite
    power: int = 1
    target: Finite = 0.0


class TerminationFile(Schema):
    """An episode ends where the quantity leaves low to high."""

    quantity: Literal['angle', 'wrapped_angle', 'rate']
    joint: str
    low: float = float('-inf')
    high: float = float('inf')


class RobotFile(Schema):
    """robot.yaml."""

    name: str
    base: Literal['fixed', 'planar'] = 'fixed'
    input: Literal['voltage', 'torque']
    control_period: Positive
    integration_step: Positive
    state_rate: Positive
    episode_seconds: Positive
    gravity: Quantity = Quantity(value=9.81, unit='m/s2')
    actuators: dict[str, ActuatorFile]
    links: dict[str, LinkFile] = Field(default_factory=dict)
    joints: dict[str, JointFile] = Field(default_factory=dict)
    start_poses: dict[str, PoseFile]
    sensors: dict[str, SensorFile] = Field(default_factory=dict)
    observation: tuple[ObservedFile, ...] = ()
    reward: tuple[RewardFile, ...] = ()
    termination: tuple[TerminationFile, ...] = ()
