# SPDX-License-Identifier: Apache-2.0
"""The input counts the other way round than the angle."""

from __future__ import annotations

from dataclasses import replace

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.faults.base import Fault, Patch
from leo_diffmodel.faults.catalogue.speed_scale import scaled


class InputSign(Fault):
    """The input counts the other way round than the angle."""

    name = 'input_sign'
    channel = 'input'
    law = 'u_log = -u'
    harmless = (0.0, float('inf'))
    looks_like = 'The joint goes against its motor.'
    confused_with = 'angle and speed both turned about: the same thing, mended at either end.'
    costs = 'A negative gain, or a hand.'

    def spoil(self, e: Episode, j: int, a: int, value: float) -> Episode:
        """Turn the input about."""
        return replace(e, inputs=scaled(e.inputs, a, -1.0))

    def patch(self, value: float) -> Patch:
        """Turn it back."""
        return {'input_scale': -1.0}
