# SPDX-License-Identifier: Apache-2.0
"""The friction laws that a data sheet compares, and the numbers of its fits."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Rung:
    """A friction law: the one of another rung, and one effect more."""

    name: str
    effect: str = ''
    on: str = ''


RUNGS = (
    Rung('none'),
    Rung('viscous', 'viscous_friction', 'none'),
    Rung('Coulomb', 'coulomb_friction', 'none'),
    Rung('Coulomb, viscous', 'viscous_friction', 'Coulomb'),
    Rung('Stribeck, viscous', 'stribeck_friction', 'viscous'),
    Rung('load-dependent', 'load_dependent_friction', 'Coulomb, viscous'),
    Rung('load-dependent Stribeck', 'stribeck_load_friction', 'Coulomb, viscous'),
    Rung('load-dependent directional', 'directional_load_friction', 'Coulomb, viscous'),
    Rung('load-dependent square', 'quadratic_load_friction', 'Coulomb, viscous'),
    Rung('drag', 'quadratic_drag', 'Coulomb, viscous'),
)
"""From the lowest on. The fourth to the ninth are near M1 to M6 of Rhoban BAM (arXiv 2410.08650),
which keep the Stribeck term of M2 in those above it."""

FRICTION = frozenset(rung.effect for rung in RUNGS if rung.effect)

COMMON = ('coulomb_friction', 'viscous_friction', 'quadratic_load_friction')
"""With which everything else is looked for."""

FIGURES = ('torque_constant', 'resistance', 'rotor_inertia')
"""Constants of a motor that a sheet measures where the robot has them."""
THE_SAME = ('torque_scale', 'voltage_scale', 'back_emf_scale', 'armature')
"""Effects that such a constant holds already."""
TIMES = 5.0
"""How far a constant may be from robot.yaml, where that does not say: a fifth of it to five times;
published figures of one servo (STS3215) differ so much."""
FINER = 0.25  # of the integration step before, that of the next of the last fits
STEP_ERROR = 0.5
"""What a step may leave in a value, in standard errors, for no finer one to follow."""
MOST_FINER = 2
"""Finer steps at most, to 0.3 ms: at 0.08 ms a fit with load and delay takes minutes."""
UNTOLD = 0.5
"""A value with a 95 % interval wider than this to a side, as a share of it, is not known."""
TOGETHER = 0.95  # correlation from which on it is said with what else a value could be exchanged
