# SPDX-License-Identifier: Apache-2.0
"""The schema of robot.yaml."""

from typing import Annotated, Literal

from pydantic import Field

from leo_sim.common.yaml_file import Finite, Name, Positive, Quantity, Schema
from leo_sim.description.servos import Family

LENGTH = (-1e4, 1e4)  # m
Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]  # rad, m, or either per s
Length = Annotated[float, Field(ge=LENGTH[0], le=LENGTH[1])]
Drawn = Coordinate | tuple[Coordinate, Coordinate]
Seconds = Annotated[float, Field(ge=1e-6, le=1e3)]
OfJoint = Literal['angle', 'wrapped_angle', 'cos', 'sin', 'rate']
OfStep = Literal['step', 'fall', 'com_forward', 'ankle_forward', 'motor_power']


class ActuatorFile(Schema):
    """Figures of an actuator, all at the joint side of its gear; of a servo also its loop."""

    limit: Quantity
    torque_constant: Quantity | None = None
    resistance: Quantity | None = None
    supply: Quantity | None = None
    position_gain: Quantity | None = None  # duty for an error of 1 rad
    rate_gain: Quantity | None = None  # duty for a rate of 1 rad/s
    resolution: Quantity | None = None  # its count of angles
    goal_rate: Quantity | None = None  # how fast it lets its goal move
    stiffness: Quantity | None = None  # torque for an error of 1 rad, in place of position_gain
    damping: Quantity | None = None  # torque for a rate of 1 rad/s
    effort: Quantity | None = None  # its largest torque
    efficiency: Quantity | None = None
    rotor_inertia: Quantity | None = None


class LinkFile(Schema):
    """Inertial figures that override the URDF; inertia = about the CoM along the joint axis."""

    mass: Quantity | None = None
    com_x: Quantity | None = None
    com_y: Quantity | None = None
    com_z: Quantity | None = None
    inertia: Quantity | None = None
    force_x: Quantity | None = None
    force_z: Quantity | None = None


class JointFile(Schema):
    """Passive figures of a joint that override the URDF; other joints whose motors turn it."""

    damping: Quantity | None = None  # viscous friction
    friction: Quantity | None = None  # dry
    turns_with: dict[str, Finite] = Field(default_factory=dict)  # rad for 1 rad of their motors


class GroundFile(Schema):
    """The floor through the origin, as a foot of rubber feels it; slope positive uphill in +x."""

    stiffness: Quantity
    damping: Quantity
    friction: Quantity
    slope: Quantity = Quantity(value=0.0, unit='rad')


class ContactFile(Schema):
    """A sphere that touches the ground: centre in link axes and radius m."""

    link: str
    x: Length
    z: Length
    radius: Annotated[Length, Field(ge=0)]
    stiffness: Positive | None = None  # N/m, where it is softer than a foot
    damping: Positive | None = None  # N s/m


class PoseFile(Schema):
    """A start pose: values, or [low, high] to draw from; joints left out start at 0."""

    angles: dict[str, Drawn] = Field(default_factory=dict)
    rates: dict[str, Drawn] = Field(default_factory=dict)
    held: bool = False  # fixes the base
    on_ground: bool = False  # puts base_z where the lowest contact touches the ground


class SensorFile(Schema):
    """A joint's encoder; resolution 0 is not quantised."""

    angle_resolution: Annotated[Finite, Field(ge=0)] = 0.0
    rate_resolution: Annotated[Finite, Field(ge=0)] = 0.0
    input_noise: Annotated[Finite, Field(ge=0)] = 0.0
    """Of an input which is measured, such as a torque: standard deviation of one sample at the
    state rate, in the unit of the input, white; 0 is exact."""
    offset: Quantity | None = None  # what it reads at angle 0


class ObservedFile(Schema):
    quantity: OfJoint
    joint: str


class RewardFile(Schema):
    """A term of the reward: weight (quantity - target)^power.

    Quantities of a joint are those after the step; the others are of the whole robot and step.
    """

    quantity: Literal[OfJoint, 'input', OfStep]
    joint: str | None = None
    weight: Finite
    power: int = 1
    target: Finite = 0.0


class TerminationFile(Schema):
    """An episode ends where the quantity leaves low to high; a rule may be kept switched off."""

    quantity: Literal['angle', 'wrapped_angle', 'rate', 'height_over_feet']
    joint: str
    low: float = float('-inf')
    high: float = float('inf')
    active: bool = True


class SchemeFile(Schema):
    """How a robot on the ground is integrated."""

    integration_step: Seconds  # longest substep
    geometry_every: Annotated[int, Field(ge=1)] = 1  # substeps between geometry updates
    switching: Seconds = 1e-3  # longest mean of a command that changes while held (delay, lag)


class ServoFile(Schema):
    """A servo, or an encoder of the same kind where the joint has no actuator."""

    id: Annotated[int, Field(ge=0, le=252)]
    model: str
    direction: Literal[1, -1] = 1  # 1 where its counts grow with the joint
    zero: int = 2048  # the count at joint angle 0
    gear: Positive = 1.0  # how far it turns per rad (slides: per m) of the joint
    low: float = float('-inf')  # beyond low to high [rad] nothing drives the joint further out
    high: float = float('inf')
    current_limit: Quantity | None = None  # no more is asked of the motor
    torque_constant: Quantity | None = None  # at the joint; a torque-driven one needs it

    @property
    def ratio(self) -> float:
        """The servo's angle for 1 rad (m) of the joint."""
        return self.direction * self.gear


class BusFile(Schema):
    port: str = '/dev/ttyUSB0'
    baud: Annotated[int, Field(ge=9600, le=4_500_000)] = 1_000_000
    servos: dict[str, ServoFile]


class DynamixelFile(BusFile):
    """A bus of Dynamixel servos; without a packet for as long as `watchdog` says they stop."""

    watchdog: Quantity = Quantity(value=0.2, unit='s')


class FeetechFile(BusFile):
    """A bus of Feetech servos, which have no watchdog."""

    port: str = '/dev/ttyACM0'


class DriverFile(Schema):
    """How the hardware is connected, by the name of its driver."""

    dynamixel: DynamixelFile | None = None
    feetech: FeetechFile | None = None

    @property
    def bus(self) -> BusFile | None:
        return self.dynamixel or self.feetech

    @property
    def family(self) -> Family:
        return 'dynamixel' if self.dynamixel else 'feetech'


class RobotFile(Schema):
    name: Name
    base: Literal['fixed', 'planar'] = 'fixed'
    input: Literal['voltage', 'torque', 'position']
    control_period: Seconds
    integration_step: Seconds
    geometry_every: Annotated[int, Field(ge=1)] = 1
    training: SchemeFile | None = None
    search: SchemeFile | None = None
    state_rate: Annotated[float, Field(ge=1e-3, le=1e6)]
    episode_seconds: Annotated[float, Field(gt=0, le=1e6)]
    gravity: Quantity = Quantity(value=9.81, unit='m/s2')
    actuators: dict[str, ActuatorFile]
    links: dict[str, LinkFile] = Field(default_factory=dict)
    joints: dict[str, JointFile] = Field(default_factory=dict)
    ground: GroundFile | None = None
    contacts: dict[Name, ContactFile] = Field(default_factory=dict)
    feet: tuple[str, ...] = ()
    start_poses: dict[Name, PoseFile]
    sensors: dict[str, SensorFile] = Field(default_factory=dict)
    observation: tuple[ObservedFile, ...] = ()
    reward: tuple[RewardFile, ...] = ()
    termination: tuple[TerminationFile, ...] = ()
    driver: DriverFile = DriverFile()
