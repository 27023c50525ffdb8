# SPDX-License-Identifier: Apache-2.0
"""What can be wrong with logged inputs, and with the stamps of a log."""

from collections.abc import Sequence

from leo_diffmodel.faults.base import Factor, Fault, Patch


class InputScale(Factor):
    """The logged input is a multiple of what acted: counts, per cent, amperes."""

    name = 'input_scale'
    channel = 'input'
    key = 'input_scale'
    law = 'u_log = k u'
    harmless = (1 / 6, 6.0)
    """A motor may be three times weaker or stronger than its data sheet (gear, supply), and carry
    a payload of twice the mass of its link."""
    looks_like = 'The motor seems many times too weak or too strong, evenly.'
    confused_with = 'torque_scale, voltage_scale (the same, small); link_mass: a weak motor.'
    costs = 'The motor comes out with a gain that no motor has.'


class InputSign(InputScale):
    """The input counts the other way round than the angle."""

    name = 'input_sign'
    law = 'u_log = -u'
    harmless = (0.0, float('inf'))
    looks_like = 'The joint goes against its motor.'
    confused_with = 'angle and speed both turned about: the same thing, mended at either end.'
    costs = 'A negative gain, or a hand.'


class InputExchanged(Fault):
    """The inputs of some joints stand in each other's columns."""

    name = 'input_exchanged'
    channel = 'input'
    law = 'u_log of joint i is u of joint k'
    harmless_words = 'never'
    looks_like = 'Joints move against their inputs, and with those of another one.'
    confused_with = 'A coupling between joints, where both inputs are alike.'
    costs = 'A hand at each of them.'
    whole_log = True

    def patch(self, value: float, names: Sequence[str] = ()) -> Patch:
        return {'input_of': dict(zip(names[::2], names[1::2], strict=True))}


class InputDead(Fault):
    """The log has exactly 0 for an input that acted all the same."""

    name = 'input_dead'
    channel = 'input'
    law = 'u_log = 0 in a share of the rows'
    harmless_words = 'zeros that the motion agrees with'
    looks_like = 'A joint carries its weight, or speeds up, with nothing at its motor.'
    confused_with = 'A hand, where the input is 0 throughout.'
    costs = 'A hand, or a motor without strength.'
    todo = 'log what the motor was sent; leo bag fix leaves these stretches out'


class InputLate(Fault):
    """The inputs act later, or earlier, than their stamps say: two clocks, a queue."""

    name = 'input_late'
    channel = 'input'
    unit = 's'
    key = 'input_late'
    law = 'u(t) = u_log(t - d)'
    harmless = (0.0, 0.06)
    """s: what explain tries as `command_delay` and `actuator_lag`; a sample before that may be
    how states and inputs share a row."""
    looks_like = 'The motor acts before its command, or long after it.'
    confused_with = 'command_delay, actuator_lag (the same, small); friction at turning points.'
    costs = 'Damping, inertia and delays come out wrong together.'
    whole_log = True


class GravityCompensated(Fault):
    """The logged torque is without what carried the weight: a controller added that itself."""

    name = 'gravity_compensated'
    channel = 'input'
    law = 'u_log = u + s g(q), g the torque of gravity'
    harmless = (-0.5, 0.5)
    """Share s of the weight: a payload or a spring takes less than half of it."""
    looks_like = 'The robot moves as if it weighed nothing.'
    confused_with = 'A spring or a counterweight, link_mass.'
    costs = 'Masses come out near zero.'
    todo = 'log the torque that the motor was sent, the part that carries the weight included'


class TimeStretch(Factor):
    """The log's seconds are not seconds: stamps that count frames of another rate."""

    name = 'time_stretch'
    channel = 'time'
    key = 'time_scale'
    law = 't_log = k t'
    harmless = (0.85, 1.18)
    """A model whose inertia is off by a third swings so much slower or faster."""
    looks_like = 'Swings of another period than gravity gives, speeds that are a multiple.'
    confused_with = 'speed_scale where speeds were measured; armature and link_inertia without.'
    costs = 'Inertia comes out wrong by the square of it.'
    whole_log = True
