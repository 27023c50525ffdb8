# SPDX-License-Identifier: Apache-2.0
"""Whether a bag in which no input was found is one of a robot whose motors were off.

Goals, and topics that look like commands, say that they were not.
"""

from leo_msgs_py.bag_contents import TopicLog
from leo_msgs_py.cdr import typestore
from leo_msgs_py.errors import UserError

from .goals import goal_topics, names_joints
from .states import deserialize
from .topic_map import RobotBag, Role
from .types import APPLIED, FLOAT64_ARRAY, JOINT_STATE, TRAJECTORY

WORDS = ('command', 'cmd', 'goal', 'reference', 'desired', 'target', 'setpoint')
"""What a topic is called that says what is asked of a robot."""
_HINTS = {
    JOINT_STATE: 'topics: {{applied: {0}}}',
    FLOAT64_ARRAY: 'topics: {{commands: {0}}} and command_order: [joints]',
    TRAJECTORY: 'topics: {{trajectory: {0}}}',
}
"""How a topic map says of a type what it is."""
_OTHERS = (
    *(f'std_msgs/msg/{name}' for name in ('Float64', 'Float32', 'Float32MultiArray')),
    *(f'std_msgs/msg/Int{bits}MultiArray' for bits in (16, 32)),
    *(f'control_msgs/msg/{name}' for name in ('JointJog', 'MultiDOFCommand')),
    'control_msgs/msg/DynamicInterfaceGroupValues',
)
"""Types of commands that are not read."""


def refuse_driven(bag: RobotBag) -> None:
    """Refuse a bag whose robot was driven by goals its model cannot take, or unread commands."""
    robot = bag.robot
    if not robot.actuators:
        return
    if robot.input != 'position' and (topic := _goals(bag)):
        raise UserError(
            f'{bag.path} was driven by position goals ({topic.name}), and {robot.name} takes '
            f'{robot.input}; give a model of the servos themselves, with input: position'
        )
    if unread := unread_commands(bag):
        hint = _HINTS.get(unread[0].type, '').format(unread[0].name)
        how = f'say in a topic map what it is ({hint})' if hint else f'write it as {FLOAT64_ARRAY}'
        raise UserError(
            f'{bag.path} has no input that is read, and it was not passive: {named(unread)}; '
            f'{how}, or say input: none in a topic map if the motors were off'
        )


def _goals(bag: RobotBag) -> TopicLog | None:
    stated = bag.contents.topics.get(APPLIED['position'].name)
    if stated is not None and stated.messages:
        return stated
    roles: tuple[Role, ...] = ('controller_state', 'trajectory')
    found = (topic for role in roles for topic in goal_topics(bag, role))
    return next((topic for topic in found if names_joints(topic, bag.motors)), None)


def unread_commands(bag: RobotBag, source: str = '') -> list[TopicLog]:
    taken = {*source.split(', '), bag.map.topics.get('joint_states')}
    topics = (topic for topic in bag.contents.topics.values() if topic.name not in taken)
    return [topic for topic in topics if _looks_like_one(topic, bag.motors)]


def _looks_like_one(topic: TopicLog, names: list[str]) -> bool:
    """Say so by type and name, and where its messages name joints by those; none decodes: no."""
    if topic.type not in (*_HINTS, *_OTHERS) or not topic.messages:
        return False
    if topic.type != TRAJECTORY and not any(word in topic.name.lower() for word in WORDS):
        return False
    if topic.type not in typestore().fielddefs:
        return True
    message = next((m for _, m in deserialize(topic, topic.type)), None)
    theirs = {*getattr(message, 'name', ()), *getattr(message, 'joint_names', ())}
    return message is not None and (not theirs or bool(theirs & set(names)))


def named(topics: list[TopicLog]) -> str:
    words = ', '.join(f'{t.name} ({t.type}, {len(t.messages)} messages)' for t in topics)
    what = 'looks like a command and is' if len(topics) == 1 else 'look like commands and are'
    return f'{words} {what} not read'
