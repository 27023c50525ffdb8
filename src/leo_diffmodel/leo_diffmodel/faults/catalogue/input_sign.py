# SPDX-License-Identifier: Apache-2.0
"""The input counts the other way round than the angle."""

from __future__ import annotations

from leo_diffmodel.faults.base import Array, Fault, Patch


class InputSign(Fault):
    """The input counts the other way round than the angle."""

    name = 'input_sign'
    channel = 'input'
    law = 'u_log = -u'
    harmless = (0.0, float('inf'))
    looks_like = 'The joint goes against its motor.'
    confused_with = 'angle and speed both turned about: the same thing, mended at either end.'
    costs = 'A negative gain, or a hand.'

    def logged(self, t: Array, x: Array, value: float) -> Array:
        return -x

    def patch(self, value: float) -> Patch:
        return {'input_scale': -1.0}
