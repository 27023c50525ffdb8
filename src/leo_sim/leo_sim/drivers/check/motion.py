# SPDX-License-Identifier: Apache-2.0
"""What shows only when the robot moves: signs, units, limits. Each joint by itself, a little."""

from dataclasses import dataclass

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.values import Applied, JointStates
from leo_sim.drivers.base import DriverBug, DriverFault, NoAnswer
from leo_sim.drivers.check.contract import check_applied
from leo_sim.drivers.check.trial import Broken, LeftOut, Moving, Trial
from leo_sim.model.model import Model
from leo_sim.model.state import State

PUSHES = 4  # a joint that does not move is pushed harder so often, up to the whole share
PUSH_SECONDS = 0.3  # how long a push lasts at most
STILL = 0.02  # a joint that moved less [share of the range] did not
UNIT = 8.0
"""A factor between measured and expected motion that is another unit, not another friction."""
TOLD = 3.0
"""A factor between what is commanded and what is said to be applied that is neither counts, nor
noise of what is measured, nor a limit of the servo: a push ends with the first that moves."""
UNITS = 'look at units: rad, not deg (57) nor counts; volts, not PWM; the gear'


@dataclass(frozen=True)
class Push:
    """A command [V, N m or rad], (A,), on one actuator, and what came of it while it was held."""

    command: np.ndarray
    states: list[JointStates]
    applied: list[Applied | None]

    def moved(self, joint: int) -> float:
        return float(self.states[-1].position[joint] - self.states[0].position[joint])

    def summed(self, joint: int) -> float:
        times = np.array([state.stamp for state in self.states])
        rates = np.array([state.velocity[joint] for state in self.states])
        return float(np.sum(0.5 * (rates[1:] + rates[:-1]) * np.diff(times)))

    @property
    def seconds(self) -> float:
        return self.states[-1].stamp - self.states[0].stamp


def signs_and_units(trial: Trial) -> None:
    """A command above 0 moves its joint as the model says: which way, and about how far.

    Gravity may be stronger than the push: then the model says so, too. What is said to be applied
    is what was commanded.
    """
    _possible(trial, trial.read())
    moving = _allowed(trial)
    for k, name in enumerate(trial.info.actuators):
        _rest(trial)
        push = _push(trial, k, moving)
        joint = trial.info.joints.index(name)
        moved, summed = push.moved(joint), push.summed(joint)
        expected = _expected(trial, push, name)
        if moved * expected < 0.0:
            way = 'up' if push.command[k] > trial.hold[k] else 'down'
            raise Broken(
                f'{name} moved {moved:.3g} when it was commanded {way}, the model {expected:.3g}',
                'change the sign of its encoder, or that of its motor',
            )
        if not 1.0 / UNIT < summed / moved < UNIT:
            raise Broken(
                f'{name} moved {moved:.3g}, its velocities add up to {summed:.3g}',
                'give the velocity in rad/s (m/s), with the sign of the position',
            )
        if not abs(expected) / UNIT < abs(moved) < UNIT * abs(expected):
            raise Broken(f'{name} moved {moved:.3g}, the model {expected:.3g}', UNITS)
        _check_told(trial, push, k)


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
    except (DriverBug, NoAnswer):
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
    name = trial.info.actuators[k]
    joint = trial.info.joints.index(name)
    for count in range(1, PUSHES + 1):
        command = trial.hold.copy()
        command[k] += count / PUSHES * _strongest(trial, k, moving)
        push = Push(command, [], [])
        for _ in range(2 + round(PUSH_SECONDS / trial.period)):
            state, applied = trial.tick(command)
            push.states.append(state)
            push.applied.append(applied)
            if abs(push.moved(joint)) > 0.5 * moving.range:
                break
        trial.tick(trial.hold)
        if abs(push.moved(joint)) > STILL * moving.range:
            return push
    more = f'; or allow more: --share {min(1.0, 2.0 * moving.share):g}'
    raise Broken(
        f'{name} does not move with {moving.share:.0%} of its limit',
        'look at its cable and its id' + (more if moving.share < 1.0 else ''),
    )


def _strongest(trial: Trial, k: int, moving: Moving) -> float:
    name = trial.info.actuators[k]
    goals, (joint,) = trial.info.goals, (j for j in trial.robot.joints if j.name == name)
    low, high = joint.limits if goals is None else goals[:, k]
    here = float(trial.read().of((name,)).position[0])
    most = moving.range if goals is not None else moving.share * float(trial.info.limits[k])
    return most if high - here >= here - low else -most


def _expected(trial: Trial, push: Push, name: str) -> float:
    if push.seconds <= 0.0:
        raise LeftOut('its stamps do not grow')
    start = _possible(trial, push.states[0])
    end = Model(trial.robot).step(start, push.command, push.seconds)
    j = trial.robot.joint_names.index(name)
    return float(end.q[j] - start.q[j])


def _possible(trial: Trial, state: JointStates) -> State:
    """The model's state where the robot is; far outside its stops it cannot be."""
    found = state.of(trial.robot.joint_names)
    try:
        return Model(trial.robot).state_from(found.position, found.velocity)
    except UserError as error:
        raise Broken(str(error), f'{UNITS}; then at zero, and at the stops') from error


def _check_told(trial: Trial, push: Push, k: int) -> None:
    told = [applied.values[k] for applied in push.applied if applied is not None]
    asked = push.command[k] - trial.hold[k]
    shares = (np.array(told) - trial.hold[k]) / asked
    if told and not 1.0 / TOLD < shares.max() < TOLD:
        raise Broken(
            f'{trial.info.actuators[k]} was commanded {push.command[k]:.3g}, and '
            f'{told[int(shares.argmax())]:.3g} is said to be applied',
            'return from write what was sent, in its unit and with its sign: it is what is fitted',
        )
