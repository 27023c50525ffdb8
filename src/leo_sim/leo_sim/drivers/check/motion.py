# SPDX-License-Identifier: Apache-2.0
"""What shows only when the robot moves: signs, units, limits. Each joint by itself, a little."""

from dataclasses import dataclass

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.values import JointStates
from leo_sim.drivers.base import DriverBug, DriverFault
from leo_sim.drivers.check.contract import check_applied
from leo_sim.drivers.check.trial import Broken, LeftOut, Moving, Trial
from leo_sim.model.model import Model

PUSHES = 4  # a joint that does not move is pushed harder so often, up to the whole share
PUSH_SECONDS = 0.3  # how long a push lasts at most
STILL = 0.02  # a joint that moved less [share of the range] did not
UNIT = 8.0
"""A factor between measured and expected motion that is another unit, not another friction."""


@dataclass(frozen=True)
class Push:
    """A command [V, N m or rad], (A,), on one actuator, and the states while it was held."""

    command: np.ndarray
    states: list[JointStates]

    def moved(self, joint: int) -> float:
        """How far a joint went [rad or m]."""
        return float(self.states[-1].position[joint] - self.states[0].position[joint])

    def summed(self, joint: int) -> float:
        """How far it went by its velocities [rad or m]."""
        times = np.array([state.stamp for state in self.states])
        rates = np.array([state.velocity[joint] for state in self.states])
        return float(np.sum(0.5 * (rates[1:] + rates[:-1]) * np.diff(times)))

    @property
    def seconds(self) -> float:
        """How long it lasted."""
        return self.states[-1].stamp - self.states[0].stamp


def signs_and_units(trial: Trial) -> None:
    """A command above 0 moves its joint as the model says: which way, and about how far.

    Gravity may be stronger than the push: then the model says so, too.
    """
    moving = _allowed(trial)
    for k, name in enumerate(trial.info.actuators):
        _rest(trial)
        push = _push(trial, k, moving)
        joint = trial.info.joints.index(name)
        expected = _expected(trial, push, name)
        if push.moved(joint) * expected < 0.0:
            way = 'up' if push.command[k] > trial.hold[k] else 'down'
            raise Broken(
                f'{name} moved {push.moved(joint):.3g} when it was commanded {way}, the '
                f'model {expected:.3g}',
                'change the sign of its encoder, or that of its motor',
            )
        ratio = push.summed(joint) / push.moved(joint)
        if not 1.0 / UNIT < ratio < UNIT:
            raise Broken(
                f'{name} moved {push.moved(joint):.3g}, its velocities add up to '
                f'{push.summed(joint):.3g}',
                'give the velocity in rad/s (m/s), with the sign of the position',
            )
        if not abs(expected) / UNIT < abs(push.moved(joint)) < UNIT * abs(expected):
            raise Broken(
                f'{name} moved {push.moved(joint):.3g}, the model {expected:.3g}',
                'look at units: rad, not deg (57) nor counts; volts, not PWM; the gear',
            )


def limits(trial: Trial) -> None:
    """What is commanded beyond the limits is applied within them."""
    if _allowed(trial).share < 1.0:
        raise LeftOut('it may not be driven at its limits: --share 1 tries it')
    _rest(trial)
    _, applied = trial.tick(10.0 * np.asarray(trial.info.limits))
    trial.tick(trial.hold)
    if applied is None:
        raise LeftOut('write returns None: it does not know what was applied')
    check_applied(trial, applied)


def by_hand(trial: Trial) -> None:
    """Each joint that a person turns the positive way is read as going up."""
    if trial.ask is None:
        raise LeftOut('--by-hand asks you to turn each joint')
    trial.driver.set_torque(False)
    for joint in trial.robot.joints:
        if not joint.independent:
            continue
        j = trial.info.joints.index(joint.name)
        before = trial.tick()[0].position[j]
        axis = ' '.join(f'{value:g}' for value in joint.axis)
        way = 'along' if joint.kind == 'prismatic' else 'by the right hand about'
        trial.ask(f'move {joint.name} {way} the axis {axis} of its frame in the URDF')
        if trial.tick()[0].position[j] <= before:
            raise Broken(
                f'{joint.name} was moved up and is read as going down',
                'change the sign of its encoder (direction)',
            )
    trial.driver.set_torque(True)


def unplugged(trial: Trial) -> None:
    """A cable that is out is a DriverFault or an OSError, soon, and `stop` bears it."""
    if trial.ask is None:
        raise LeftOut('--by-hand asks you to pull the cable')
    trial.ask('pull the cable out of the computer')
    try:
        for _ in range(round(5.0 / trial.period)):
            trial.tick()
    except DriverBug:
        raise
    except (DriverFault, OSError):
        return
    raise Broken(
        'it goes on for 5 s though its cable is out',
        'raise TransientFault in read for every answer that does not come',
    )


def _allowed(trial: Trial) -> Moving:
    if trial.moving is None:
        raise LeftOut('the robot may not move: --move tries it')
    return trial.moving


def _rest(trial: Trial) -> None:
    for _ in range(max(3, round(PUSH_SECONDS / trial.period))):
        trial.tick(trial.hold)


def _push(trial: Trial, k: int, moving: Moving) -> Push:
    """Push an actuator, harder each time, until its joint moves."""
    name = trial.info.actuators[k]
    joint = trial.info.joints.index(name)
    for count in range(1, PUSHES + 1):
        command = trial.hold.copy()
        command[k] += count / PUSHES * _strongest(trial, k, moving)
        push = Push(command, [])
        for _ in range(2 + round(PUSH_SECONDS / trial.period)):
            push.states.append(trial.tick(command)[0])
            if abs(push.moved(joint)) > 0.5 * moving.range:
                break
        trial.tick(trial.hold)
        if abs(push.moved(joint)) > STILL * moving.range:
            return push
    raise Broken(
        f'{name} does not move with {moving.share:.0%} of its limit',
        'look at its cable and its id; or allow more: --share 0.5',
    )


def _strongest(trial: Trial, k: int, moving: Moving) -> float:
    """The largest push on an actuator; a goal goes the way that has more room."""
    if trial.info.goals is None:
        return moving.share * float(trial.info.limits[k])
    low, high = trial.info.goals[:, k] - trial.hold[k]
    return moving.range if high > -low else -moving.range


def _expected(trial: Trial, push: Push, name: str) -> float:
    """How far the model's joint goes under the same push."""
    if push.seconds <= 0.0:
        raise LeftOut('its stamps do not grow')
    first = push.states[0].of(trial.robot.joint_names)
    model = Model(trial.robot)
    try:
        start = model.state_from(first.position, first.velocity)
    except UserError as error:
        raise LeftOut(f'the model cannot be where the robot is: {error}') from error
    end = model.step(start, push.command, push.seconds)
    j = trial.robot.joint_names.index(name)
    return float(end.q[j] - start.q[j])
