# SPDX-License-Identifier: Apache-2.0
"""Numbers, units and sentences of the report."""

import pytest

from leo_diffmodel.report import text


@pytest.mark.parametrize(
    ('value', 'shown'),
    [
        (0.0, '0'),
        (0.041234, '0.0412'),
        (-3.14159, '−3.14'),
        (12.0, '12.0'),
        (2160.0, '2160'),
        (6.17e-5, '6.17\u00a0×\u00a010⁻⁵'),
        (-4.0e7, '−4.00\u00a0×\u00a010⁷'),
        (None, '–'),
        (float('inf'), '–'),
    ],
)
def test_number(value, shown):
    assert text.number(value) == shown


@pytest.mark.parametrize(
    ('plain', 'printed'),
    [
        ('kg m2', 'kg m²'),
        ('N m s2/rad2', 'N m s²/rad²'),
        ('ohm', 'Ω'),
        ('N m/A', 'N m/A'),
        ('', ''),
    ],
)
def test_unit(plain, printed):
    assert text.unit(plain) == printed


@pytest.mark.parametrize(
    ('parameter', 'shown'),
    [
        ({'value': 0.041, 'unit': 'N m', 'ci95': [0.038, 0.044]}, '0.0410 ± 0.0030 N m'),
        ({'value': 0.7, 'unit': '', 'ci95': [0.5, 0.9]}, '0.70 ± 0.20'),
        (
            {'value': 1.2e-5, 'unit': 'kg m2', 'ci95': [1.1e-5, 1.3e-5]},
            '(1.20 ± 0.10)\u00a0×\u00a010⁻⁵ kg m²',
        ),
        ({'value': 0.01, 'unit': 's', 'ci95': [0.0, 0.06]}, '0.0100 s (0 … 0.0600)'),
        ({'value': 3.0, 'unit': 'V', 'ci95': [3.0, 3.0]}, '3.00 V (not determined)'),
    ],
)
def test_estimate(parameter, shown):
    assert text.estimate(parameter) == shown


@pytest.mark.parametrize(
    ('share', 'shown'),
    [
        (0.0, '0 %'),
        (1e-5, '0 %'),
        (0.003, '0.3 %'),
        (0.42, '42 %'),
        (0.998, '99.8 %'),
        (1, '100 %'),
    ],
)
def test_percent(share, shown):
    assert text.percent(share) == shown


@pytest.mark.parametrize(('after', 'shown'), [(0.1, '−75 %'), (0.5, '+25 %'), (0.4, '0 %')])
def test_change_has_its_sign(after, shown):
    assert text.change(0.4, after) == shown


@pytest.mark.parametrize(
    ('value', 'shown'), [(32903.4, '32\u202f903'), (1e-10, '0'), (8.2, '8.20')]
)
def test_nats(value, shown):
    assert text.nats(value) == shown


def test_prose_escapes_and_sets_effects_apart():
    shown = str(text.prose('<b>coulomb_friction:pivot</b> & 0.4 -> 0.1'))
    assert '<b class="effect">coulomb_friction:pivot</b>' in shown
    assert shown.startswith('&lt;b&gt;') and '&amp; 0.4 → 0.1' in shown.replace('-&gt;', '→')


def test_a_unit_in_a_sentence_is_raised_whole():
    assert text.prose('d = 7 N m s2/rad2 at m2, 9.8 m/s2, 1 kg m2, 2 N m s/rad') == (
        'd = 7 N m s²/rad² at m2, 9.8 m/s², 1 kg m², 2 N m s/rad'
    )
