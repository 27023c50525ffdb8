# SPDX-License-Identifier: Apache-2.0
"""The logged input is a multiple of what acted: counts, per cent, amperes."""

from __future__ import annotations

from leo_diffmodel.faults.base import Array, Fault, Patch


class InputScale(Fault):
    """The logged input is a multiple of what acted: counts, per cent, amperes."""

    name = 'input_scale'
    channel = 'input'
    law = 'u_log = k u'
    harmless = (1 / 6, 6.0)
    """A motor may be three times weaker or stronger than its data sheet (gear, supply), and carry
    a payload of twice the mass of its link."""
    looks_like = 'The motor seems many times too weak or too strong, evenly.'
    confused_with = 'torque_scale, voltage_scale (the same, small); link_mass: a weak motor.'
    costs = 'The motor comes out with a gain that no motor has.'

    def logged(self, t: Array, x: Array, value: float) -> Array:
        return value * x

    def patch(self, value: float) -> Patch:
        return {'input_scale': 1 / value}
