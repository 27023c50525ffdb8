# SPDX-License-Identifier: Apache-2.0
"""What every driver keeps to, one function each, in the order in which they are tried.

Each takes a Trial and raises Broken (what is wrong, what to mend), or LeftOut or the driver's
NotPossible (why not tried).
Nothing here drives a motor.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from leo_msgs_py.values import Applied
from leo_sim.drivers.base import Haltable, Inspected
from leo_sim.drivers.check.trial import Broken, LeftOut, Trial

PERIODS = 50  # how many periods are looked at
WALL = 1.0  # a stamp farther from the clock on the wall than this [s] is none


def info(trial: Trial) -> None:
    """`info` fits the robot before `connect`."""
    found, robot = trial.info, trial.robot
    if sorted(found.joints) != sorted(robot.joint_names):
        raise Broken(
            f'joints are {list(found.joints)}, the robot has {list(robot.joint_names)}',
            'take the names of the URDF, every joint that moves',
        )
    actuators = tuple(actuator.joint for actuator in robot.actuators)
    if found.actuators != actuators:
        raise Broken(
            f'actuators are {list(found.actuators)}, robot.yaml has {list(actuators)}',
            'keep the order of robot.yaml: commands come in it',
        )
    limits = np.asarray(found.limits, float)
    if limits.shape != (len(actuators),) or not (np.isfinite(limits) & (limits > 0)).all():
        raise Broken(f'limits are {limits.tolist()}', 'one finite number above 0 per actuator')
    if (found.goals is None) != (robot.input != 'position'):
        raise Broken(
            f'goals are {found.goals}, robot.yaml says input: {robot.input}',
            'build info with drivers.base.robot_info(robot)',
        )
    if not (found.control_period > 0 and found.state_rate > 0):
        raise Broken(
            f'control_period {found.control_period}, state_rate {found.state_rate}',
            'both are above 0',
        )


def stop_first(trial: Trial) -> None:
    """`stop` before `connect` does no harm: a node that fails to start calls it."""
    trial.driver.stop()


def connect(trial: Trial) -> None:
    """`connect` opens the device."""
    trial.driver.connect()
    if isinstance(trial.driver, Inspected):
        trial.found = trial.driver.findings()


def shapes(trial: Trial) -> None:
    """`read` gives finite float arrays, one value per joint, in the order of `info.joints`."""
    state = trial.read()
    if tuple(state.names) != tuple(trial.info.joints):
        raise Broken(f'read names {list(state.names)}', 'use info.joints, in that order')
    for name in ('position', 'velocity'):
        values = np.asarray(getattr(state, name))
        fits = values.shape == (len(trial.info.joints),) and values.dtype.kind == 'f'
        if not fits or not np.isfinite(values).all():
            raise Broken(
                f'{name} is {values.tolist()}',
                'give finite floats, one value per joint; where a sensor has no value, raise '
                'TransientFault',
            )


def stamps(trial: Trial) -> None:
    """Stamps are whole nanoseconds that grow; of hardware they are the wall's time."""
    found = [trial.tick()[0].stamp_ns for _ in range(PERIODS)]
    if not all(isinstance(stamp, (int, np.integer)) for stamp in found):
        raise Broken(f'stamp_ns is {found[0]!r}', 'give int nanoseconds, say time.time_ns()')
    if min(np.diff(found)) <= 0:
        raise Broken('a stamp is not above the one before', 'stamp each state when it is measured')
    off = trial.computer.time_ns() - found[-1]
    if not trial.info.own_clock and abs(off) > WALL * 1e9:
        raise Broken(
            f'the stamp is {off * 1e-9:.3g} s from the clock on the wall',
            'use time.time_ns(); or set own_clock and move time in advance',
        )
    passed, meant = (found[-1] - found[0]) * 1e-9, (PERIODS - 1) * trial.period
    if trial.info.own_clock and abs(passed - meant) > 0.01 * meant:
        raise Broken(
            f'{PERIODS - 1} periods are {passed:.3g} s by the stamps, {meant:.3g} s by '
            'info.state_rate',
            'advance by the seconds that are asked for',
        )


def pace(trial: Trial) -> None:
    """`read` and `write` fit into a period, and `advance` of hardware does not wait."""
    trial.loops.clear()
    trial.waits.clear()
    for _ in range(PERIODS):
        trial.tick()
    busy, waits = float(np.median(trial.loops)), float(np.median(trial.waits))
    if not trial.info.own_clock and waits > 0.5 * trial.period:
        raise Broken(f'advance takes {1e3 * waits:.3g} ms', 'return at once: the node waits')
    if busy > trial.period:
        raise Broken(
            f'reading and writing take {1e3 * busy:.3g} ms of a period of '
            f'{1e3 * trial.period:.3g}',
            'lower -p state_rate:=, or read all at once',
        )


def writing(trial: Trial) -> None:
    """`write` of 0 applies 0, a goal of NaN frees; in the order and unit of `info`."""
    state, applied = trial.tick()
    if applied is None:
        raise LeftOut('write returns None: it does not know what was applied')
    check_applied(trial, applied)
    if trial.info.goals is not None and np.any(applied.enabled):
        raise Broken(
            'NaN was written, but what is applied says motors on',
            'a goal of NaN frees its motor: torque off',
        )
    if np.any(applied.values):
        raise Broken(
            f'0 was written, {applied.values.tolist()} applied',
            '0 must stay 0 after every clip and offset',
        )
    if not state.stamp_ns <= applied.stamp_ns:
        raise Broken(
            'what is applied is stamped before the state that was read just now',
            'stamp it when it is sent',
        )


def halting(trial: Trial) -> None:
    """`halt` brings the motors to 0, or free, from another thread, whatever `read` waits for."""
    if trial.info.own_clock:
        raise LeftOut('its time stands still while nobody asks')
    if not isinstance(trial.driver, Haltable):
        raise Broken(
            'it has no halt()',
            'give it one that sends 0 at once and takes no lock that '
            'read holds: a read that hangs must not delay 0',
        )
    with ThreadPoolExecutor(1) as another:
        halted = another.submit(trial.driver.halt)
        trial.read()
        halted.result()
    trial.tick()


def torque(trial: Trial) -> None:
    """`set_torque(False)` frees the motors and `write` says so; on again begins at rest."""
    if not trial.info.own_clock and trial.moving is None:
        raise LeftOut('a free robot may fall: --move tries it')
    trial.driver.set_torque(False)
    _, applied = trial.tick()
    trial.driver.set_torque(True)
    if applied is not None and np.any(applied.enabled):
        raise Broken(
            'torque is off, but what is applied says motors on',
            'give Applied its enabled: a free motor is no braking one',
        )
    _, applied = trial.tick()
    if applied is None or trial.info.goals is not None:
        return  # without a goal a motor is free
    if not np.all(applied.enabled):
        raise Broken('torque is on again, but what is applied says motors free', 'as above')


def resetting(trial: Trial) -> None:
    """`reset` begins an episode, or says that it is not possible."""
    before = trial.driver.starts
    trial.driver.reset()
    if trial.driver.starts != before + 1:
        raise Broken(
            f'reset took starts from {before} to {trial.driver.starts}',
            'count each new beginning: self.starts += 1',
        )


def stop_twice(trial: Trial) -> None:
    """`stop` may be called twice."""
    trial.driver.stop()
    trial.driver.stop()


def check_applied(trial: Trial, applied: Applied) -> None:
    if tuple(applied.names) != tuple(trial.info.actuators):
        raise Broken(f'applied names {list(applied.names)}', 'use info.actuators, in that order')
    if applied.interface != trial.info.interface:
        raise Broken(
            f'applied is in {applied.interface!r}, info says {trial.info.interface!r}',
            'publish in the unit of the robot: voltage V, effort N m, position rad',
        )
    if np.shape(applied.values) != (len(trial.info.actuators),):
        raise Broken(f'applied has shape {np.shape(applied.values)}', 'one value per actuator')
    low, high = trial.info.bounds
    slack = 1e-3 * np.asarray(trial.info.limits)
    values = applied.nan_where_free
    if np.any(values < low - slack) or np.any(values > high + slack):
        raise Broken(
            f'applied {values.tolist()} is beyond the limits, {low.tolist()} to {high.tolist()}',
            'clip to info.limits in write, goals to info.goals',
        )
