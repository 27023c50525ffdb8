# SPDX-License-Identifier: Apache-2.0
"""How another robot's bag maps to ours: names, signs, offsets, when an input acts.

A topic map has any of these keys; docs/your_robot.md explains all of them:

    topics: {joint_states: /arm/joint_states, commands: /arm/pwm_controller/commands}
    joints: {pivot: {name: joint_1, sign: -1, offset: 0.1}}  # ours = sign * theirs + offset [rad]
    command_order: [pivot]                                   # joints of the command topic
    scale: 0.0156                                            # supply / 885 of a PWM in counts
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field

from leo_msgs_py.bag_contents import BagContents, TopicLog
from leo_msgs_py.errors import UserError
from leo_sim.common.yaml_file import Fixed, read
from leo_sim.description.robot import Robot
from leo_sim.drivers.base import INTERFACES

from .types import EPISODE, Floats, STATES, TYPES

MOST_LATE = 10.0  # s; what comes later belongs to another recording


def _no_zero(value: float) -> float:
    if value == 0 or not isfinite(value):
        raise ValueError('a scale is a number other than 0')
    return value


Input = Literal['applied', 'dynamic_joint_states', 'commands', 'controller_state', 'trajectory']
"""Topics with what drove the robot."""
Role = Literal['joint_states', Input, 'episode']
DEFAULT_NAMES = {
    'joint_states': STATES.name,
    'dynamic_joint_states': '/dynamic_joint_states',
    'episode': EPISODE.name,
}
COMMANDS = {kind: f'/{name}_controller/commands' for kind, name in INTERFACES.items()}

Factor = Annotated[float, AfterValidator(_no_zero)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Seconds = Annotated[float, Field(ge=-MOST_LATE, le=MOST_LATE, allow_inf_nan=False)]


class JointMap(Fixed):
    """Where one of our joints is in the bag, and how its channels are to be mended.

    angle = sign * scale * theirs + offset; speed(t) = sign * speed_scale *
    (theirs(t + speed_late) - speed_zero), or the slope of the angle where `speed` is none; its
    input is multiplied by input_scale and by input_sign (else sign), and acts input_late later.
    Theirs, of a negative speed that was logged as a positive number, is first made negative: what
    is above half of speed_wraps is that much less, or what is above speed_sign_at counts down from
    there. Where goal_is_angle, goal and angle stand in each other's place.
    """

    name: str | None = None
    sign: Literal[1, -1] = 1
    input_sign: Literal[1, -1] | None = None
    offset: float = Field(default=0.0, allow_inf_nan=False)
    scale: Factor = 1.0
    speed_scale: Factor = 1.0
    speed_zero: float = Field(default=0.0, allow_inf_nan=False)
    speed_late: Seconds = 0.0
    speed: Literal['measured', 'none'] = 'measured'
    speed_wraps: Positive | None = None
    speed_sign_at: Positive | None = None
    goal_is_angle: bool = False
    input_scale: Factor = 1.0
    input_late: Seconds = 0.0


class TopicMap(Fixed):
    topics: dict[Role, str] = Field(default_factory=dict)
    joints: dict[str, JointMap] = Field(default_factory=dict)
    input: Literal['auto', Input, 'effort', 'none'] = 'auto'
    interface: str | None = None  # its name on the dynamic joint states
    command_order: list[str] | None = None
    frame_id: str | None = None  # of the joint states, where several publish the same joints
    scale: float = Field(default=1.0, gt=0.0, allow_inf_nan=False)  # V, N m, rad for 1 of theirs
    hold: Literal['next', 'previous'] = 'next'  # previous: a stamp means the period before it
    held: bool | None = None  # whether the base was; None: what the bag's recorder noted
    input_of: dict[str, str] = Field(default_factory=dict)  # whose column an input of ours is in
    time_scale: float = Field(default=1.0, gt=0.0, allow_inf_nan=False)  # s for 1 s of its stamps
    input_late: Seconds = 0.0  # by which all inputs act after their stamps, besides their own

    def joint(self, name: str) -> JointMap:
        return self.joints.get(name, JointMap())

    def theirs(self, name: str) -> str:
        return self.joint(name).name or name

    def inputs(self, theirs: Floats, joints: Sequence[str], kind: str) -> Floats:
        """Return inputs (N, A) along our joints [V, N m or rad]; goals count from our zero."""
        maps = [self.joint(name) for name in joints]
        factors = np.array([(m.input_sign or m.sign) * m.input_scale for m in maps])
        columns = [self._column(name, joints) for name in joints]
        ours = theirs[:, columns] * self.scale * factors
        return ours + np.array([m.offset for m in maps]) if kind == 'position' else ours

    def _column(self, name: str, joints: Sequence[str]) -> int:
        source = self.input_of.get(name, name)
        if source not in joints:
            raise UserError(f'topic map: input_of {name}: no input of {source!r} is logged')
        return list(joints).index(source)


@dataclass(frozen=True)
class RobotBag:
    contents: BagContents
    robot: Robot
    map: TopicMap

    @property
    def path(self) -> Path:
        return self.contents.path

    @property
    def motors(self) -> list[str]:
        return [self.map.theirs(a.joint) for a in self.robot.actuators]

    def topic(self, role: Role, name: str | None = None) -> TopicLog | None:
        return find_topic(self.contents, role, self.map, name)


def read_topic_map(source: str | Path | TopicMap | None) -> TopicMap:
    if isinstance(source, TopicMap):
        return source
    return TopicMap() if source is None else read(Path(source), TopicMap)


def find_topic(
    contents: BagContents, role: Role, topic_map: TopicMap, name: str | None = None
) -> TopicLog | None:
    """Return the topic of a role: as mapped, else the default name, else the one ending in it."""
    if role in topic_map.topics:
        return _named(contents, topic_map.topics[role], TYPES[role])
    default = name or DEFAULT_NAMES[role]
    topics = [topic for topic in contents.of_type(TYPES[role]) if topic.name.endswith(default)]
    exact = [topic for topic in topics if topic.name == default]
    if len(exact or topics) > 1:
        names = ', '.join(topic.name for topic in topics)
        raise UserError(
            f'{contents.path} has several topics for {role}: {names}; choose one in a topic map '
            f'(topics: {{{role}: ...}})'
        )
    return next(iter(exact or topics), None)


def _named(contents: BagContents, name: str, type_name: str) -> TopicLog:
    topic = contents.topics.get(name)
    if topic is None:
        raise UserError(f'{contents.path} has no topic {name}; it has {list_topics(contents)}')
    if topic.type != type_name:
        raise UserError(f'{name} in {contents.path} is {topic.type}, needed is {type_name}')
    return topic


def list_topics(contents: BagContents) -> str:
    found = [f'{topic.name} ({topic.type})' for topic in contents.topics.values()]
    return ', '.join(found) or 'no topics'
