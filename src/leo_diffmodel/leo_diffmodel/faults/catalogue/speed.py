# SPDX-License-Identifier: Apache-2.0
"""What can be wrong with a logged speed."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.faults.base import Factor, Fault, Patch


class SpeedScale(Factor):
    """The logged speed is a multiple of the true one: another unit or gear ratio."""

    name = 'speed_scale'
    channel = 'speed'
    key = 'speed_scale'
    law = 'w = k dq/dt'
    harmless = (0.97, 1.03)
    looks_like = 'The angle changes by another multiple than the speed says, always the same.'
    confused_with = 'angle_scale, time_stretch: the balance of torques decides who is right.'
    costs = 'Friction and inertia come out wrong by the same factor, or a hand is suspected.'


class SpeedSign(SpeedScale):
    """The logged speed has the wrong sign."""

    name = 'speed_sign'
    law = 'w = -dq/dt'
    harmless = (0.0, float('inf'))
    looks_like = 'The angle falls while the speed is positive.'
    confused_with = 'angle_sign.'
    costs = 'Friction seems to drive the joint; nothing is named, or a hand is.'


class SpeedZero(Fault):
    """The speed is not zero where the joint stands."""

    name = 'speed_zero'
    channel = 'speed'
    unit = 'rad/s'
    key = 'speed_zero'
    law = 'w = dq/dt + b'
    harmless = (-0.02, 0.02)  # of how fast the joint moves (rms)
    harmless_words = 'a fiftieth of the rms speed; a step of the sensor, which may round down'
    looks_like = 'The sum of the speeds runs away from the angle, evenly.'
    confused_with = 'speed_scale where the joint turns one way only.'
    costs = 'A constant torque or a tilt of the base is named that is not there.'


class SpeedLate(Fault):
    """The speed comes later than the angle, by a delay; one period where rows are one apart."""

    name = 'speed_late'
    channel = 'speed'
    unit = 's'
    key = 'speed_late'
    law = 'w(t) = dq/dt(t - d)'
    harmless = (-0.02, 0.06)
    """s: a driver filters, and explain tries `velocity_lag` and `measurement_delay`."""
    looks_like = 'The speed has its peaks after the angle is steepest.'
    confused_with = 'speed_filter, which rounds the peaks as well.'
    costs = 'Damping comes out wrong, or a delay of the commands is named.'


class SpeedFilter(Fault):
    """The speed goes through a first-order filter of time constant tau."""

    name = 'speed_filter'
    channel = 'speed'
    unit = 's'
    law = 'tau dw/dt = dq/dt - w'
    harmless = (-0.02, 0.1)
    """s: drivers do so; explain tries `velocity_lag`. Behind a slower one the angle knows more."""
    looks_like = 'The speed comes late, and its peaks are lower and rounder than the slope.'
    confused_with = 'speed_late, which leaves the peaks as high as they are.'
    costs = 'Nothing where velocity_lag is found as well; else damping comes out wrong.'
    todo = 'nothing: leo explain tries velocity_lag; better is to log the raw speed'

    def patch(self, value: float, names: Sequence[str] = ()) -> Patch:
        return {'speed': 'none'} if value > self.harmless[1] else {}


def unfiltered(recording: Recording, joint: str, tau: float) -> Recording:
    """A recording with the speed of one joint before its filter: the noise grows, not its sum."""
    j = recording.joints.index(joint)
    episodes = []
    for e in recording.episodes:
        dq = e.dq.copy()
        dq[:, j] += tau * np.gradient(dq[:, j], e.t)
        episodes.append(replace(e, dq=dq))
    return replace(recording, episodes=tuple(episodes))


class Clipped(Fault):
    """A sensor stays at the end of its range while the joint goes on."""

    name = 'clipped'
    channel = 'speed'
    unit = 'rad/s'
    law = 'w = clip(dq/dt, -c, c)'
    looks_like = 'Flat tops at one and the same value.'
    confused_with = 'A motor at its no-load speed: then the angle says so, too.'
    costs = 'Quadratic drag or a weak supply is named.'

    def patch(self, value: float, names: Sequence[str] = ()) -> Patch:
        return {'speed': 'none'}


class SpeedWraps(Fault):
    """A negative speed was read as a positive number: that of two's complement."""

    name = 'speed_wraps'
    channel = 'speed'
    unit = 'rad/s'
    key = 'speed_wraps'
    law = 'w_log = w, or w + c where w < 0'
    harmless_words = 'never'
    looks_like = 'Two bands of values: one from 0 up, one from c down.'
    confused_with = 'speed_sign_bit, whose upper band goes up.'
    costs = 'A zero, a scale and a sign of the speed that are all wrong.'


class SpeedSignBit(SpeedWraps):
    """A negative speed was read as a positive number: its sign bit counted as a value."""

    name = 'speed_sign_bit'
    key = 'speed_sign_at'
    law = 'w_log = w, or c - w where w < 0'
    looks_like = 'Two bands of values: one from 0 up, one from c up.'
    confused_with = 'speed_wraps, whose upper band goes down.'
