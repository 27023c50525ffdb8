# SPDX-License-Identifier: Apache-2.0
"""The logged torque is without what carried the weight."""

from __future__ import annotations

from leo_diffmodel.faults.base import Fault


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
