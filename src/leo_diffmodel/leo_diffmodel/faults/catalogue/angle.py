# SPDX-License-Identifier: Apache-2.0
"""What can be wrong with a logged angle."""

from collections.abc import Sequence
import math

from leo_diffmodel.faults.base import Factor, Fault, Patch


class AngleScale(Factor):
    """The logged angle is a multiple of the true one: degrees, per cent, a gear ratio."""

    name = 'angle_scale'
    channel = 'angle'
    key = 'scale'
    law = 'q_log = k q'
    harmless = (0.97, 1.03)
    looks_like = 'Angles far beyond the limits of the joint, or gravity that comes too often.'
    confused_with = 'speed_scale, time_stretch; encoder_scale where the speed is scaled as well.'
    costs = 'Gravity does not fit anywhere, and everything else is bent until it does.'


class AngleSign(AngleScale):
    """The logged angle has the wrong sign, the speed has not."""

    name = 'angle_sign'
    law = 'q_log = -q'
    harmless = (0.0, float('inf'))
    looks_like = 'The angle falls while the speed is positive, and inputs turn the joint back.'
    confused_with = 'speed_sign.'
    costs = 'As for speed_sign.'


class AngleZero(Fault):
    """The angle counts from another zero than the model's: upright instead of hanging."""

    name = 'angle_zero'
    channel = 'angle'
    unit = 'rad'
    turn = 2 * math.pi
    law = 'q_log = q + z'
    harmless = (-0.5, 0.5)
    """rad: a zero so far off is calibrated badly, and explain tries `encoder_offset`."""
    looks_like = 'Gravity pulls to another angle than the model says.'
    confused_with = 'encoder_offset (the same, small), a tilted base, a payload off the axis.'
    costs = 'Gravity has the wrong sign or direction, and no effect mends that.'

    def patch(self, value: float, names: Sequence[str] = ()) -> Patch:
        return {'offset': -value}


class GoalAsAngle(Fault):
    """The logged angle is the goal and no measurement."""

    name = 'goal_as_angle'
    channel = 'angle'
    law = 'q_log = goal'
    looks_like = 'The angle is the goal to the last digit, in the same row or the next.'
    confused_with = 'Nothing: no servo is that good.'
    costs = 'A robot without mass or friction.'
    todo = 'log the position that the servo reports (observation, not action)'


class GoalExchanged(Fault):
    """Angle and goal stand in each other's column: state and action of a data set."""

    name = 'goal_exchanged'
    channel = 'angle'
    unit = 's'
    law = 'q_log = goal, goal_log = q'
    harmless = (-0.06, float('inf'))
    """s by which the angle comes after its goal; a loop may write a row after the goal acted."""
    looks_like = 'The angle does in advance what its goal says later.'
    confused_with = 'Nothing: no servo knows its goals before they come.'
    costs = 'A servo that runs ahead of its goals, or a hand.'

    def patch(self, value: float, names: Sequence[str] = ()) -> Patch:
        return {'goal_is_angle': True}


class Frozen(Fault):
    """A sensor keeps its value while the joint moves: samples of a lost bus are repeated."""

    name = 'frozen'
    channel = 'angle'
    unit = 's'
    law = 'q(t) = q(t0) for a while'
    harmless_words = 'a fiftieth of the time in all: what is left says the same (a warning)'
    looks_like = 'A flat stretch of one channel while the other goes on, and a jump after it.'
    confused_with = 'A joint that stands: then the other channel says so, too.'
    costs = 'Stiction or a blow where there was none.'
    todo = 'mend encoder or bus; leo bag fix leaves these stretches out'


class Repeated(Fault):
    """Samples that repeat the one before under a new stamp: published faster than measured."""

    name = 'repeated'
    channel = 'angle'
    law = 'a share of the samples is that of the row before'
    harmless = (0.0, 0.02)  # of the samples of a moving joint: now and then a bus misses one
    looks_like = 'Stairs: every second or third step of the angle is exactly zero.'
    confused_with = 'A coarse encoder at low speed.'
    costs = 'Noise, and a delay of half the time from fresh sample to fresh sample.'
    todo = 'publish a state when it was measured, stamped then'


class Quantised(Fault):
    """The angle comes in steps that are coarse against the motion."""

    name = 'quantised'
    channel = 'angle'
    unit = 'rad'
    law = 'q_log = step round(q / step)'
    harmless = (0.0, 0.02)  # rad
    harmless_words = '0.02 rad, or a fiftieth of the range moved through where that is less'
    looks_like = 'Few different values, all multiples of one.'
    confused_with = 'Noise; backlash.'
    costs = 'Speeds that are differences of it are noise.'
    todo = 'log more digits, or the counts of the encoder'
