# SPDX-License-Identifier: Apache-2.0
"""In which range each figure of a robot lies, whatever file says it: what no robot leaves."""

LENGTH = (-1e4, 1e4)
RANGES = {
    ('mass', 'kg'): (1e-9, 1e6),
    ('origin', 'm'): LENGTH,
    ('com_x', 'm'): LENGTH,
    ('com_y', 'm'): LENGTH,
    ('com_z', 'm'): LENGTH,
    ('inertia', 'kg m2'): (0.0, 1e9),
    ('rotor_inertia', 'kg m2'): (0.0, 1e9),
    ('rotor_inertia', 'kg'): (0.0, 1e9),
    ('force_x', 'N'): (-1e9, 1e9),
    ('force_z', 'N'): (-1e9, 1e9),
    ('gravity', 'm/s2'): (-1e3, 1e3),
    ('limit', 'V'): (1e-6, 1e6),
    ('limit', 'N m'): (1e-9, 1e9),
    ('limit', 'rad'): (1e-6, 1e6),
    ('limit', 'N'): (1e-9, 1e9),
    ('limit', 'm'): (1e-6, 1e4),
    ('supply', 'V'): (1e-6, 1e6),
    ('torque_constant', 'N m/A'): (1e-9, 1e6),
    ('torque_constant', 'N/A'): (1e-9, 1e6),
    ('resistance', 'ohm'): (1e-6, 1e6),
    ('efficiency', ''): (1e-3, 1.0),
    ('position_gain', '1/rad'): (1e-6, 1e9),
    ('position_gain', '1/m'): (1e-6, 1e9),
    ('rate_gain', 's/m'): (0.0, 1e6),
    ('resolution', 'm'): (0.0, 10.0),
    ('goal_rate', 'm/s'): (1e-6, 1e6),
    ('rate_gain', 's/rad'): (0.0, 1e6),
    ('resolution', 'rad'): (0.0, 10.0),
    ('goal_rate', 'rad/s'): (1e-6, 1e6),
    ('damping', 'N m s/rad'): (0.0, 1e9),
    ('friction', 'N m'): (0.0, 1e9),
    ('friction', 'N'): (0.0, 1e9),
    ('offset', 'm'): LENGTH,
    ('offset', 'rad'): (-1e6, 1e6),
    ('stiffness', 'N/m'): (1e-3, 1e12),
    ('damping', 'N s/m'): (0.0, 1e9),
    ('friction', ''): (0.0, 1e3),
    ('slope', 'rad'): (-1.5, 1.5),
    ('current_limit', 'A'): (1e-6, 1e6),
    ('watchdog', 's'): (1e-3, 1e3),
}
"""(figure, unit) -> its lowest and highest value in that unit."""


def outside(figure: str, unit: str, *values: float) -> str:
    """Which of some values is not in the range of a figure, and that range; '' where all are."""
    low, high = RANGES[figure, unit]
    return next(
        (
            f'{value:g} {unit} is not within {low:g} to {high:g} {unit}'.replace('  ', ' ')
            for value in values
            if not low <= value <= high
        ),
        '',
    )
