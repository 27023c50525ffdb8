# SPDX-License-Identifier: Apache-2.0
"""Numbers, units and sentences of the report."""

import pytest

from leo_diffmodel.report import text


def fitted(value: float, unit: str, *ci95: float) -> dict:
    return {'value': value, 'unit': unit, 'ci95': [*ci95]}


@pytest.mark.parametrize(
    ('said', 'shown'),
    [
        (text.number(0.0), '0'),
        (text.number(0.041234), '0.0412'),
        (text.number(-3.14159), '−3.14'),
        (text.number(12.0), '12.0'),
        (text.number(2160.0), '2160'),
        (text.number(6.17e-5), '6.17\u00a0×\u00a010⁻⁵'),
        (text.number(-4.0e7), '−4.00\u00a0×\u00a010⁷'),
        (text.number(None), '–'),
        (text.number(float('inf')), '–'),
        (text.unit('kg m2'), 'kg m²'),
        (text.unit('N m s2/rad2'), 'N m s²/rad²'),
        (text.unit('ohm'), 'Ω'),
        (text.unit('N m/A'), 'N m/A'),
        (text.unit(''), ''),
        (text.estimate(fitted(0.041, 'N m', 0.038, 0.044)), '0.0410 ± 0.0030 N m'),
        (text.estimate(fitted(0.7, '', 0.5, 0.9)), '0.70 ± 0.20'),
        (
            text.estimate(fitted(1.2e-5, 'kg m2', 1.1e-5, 1.3e-5)),
            '(1.20 ± 0.10)\u00a0×\u00a010⁻⁵ kg m²',
        ),
        (text.estimate(fitted(0.01, 's', 0.0, 0.06)), '0.0100 s (0 … 0.0600)'),
        (text.estimate(fitted(3.0, 'V', 3.0, 3.0)), '3.00 V (not determined)'),
        (text.percent(0.0), '0 %'),
        (text.percent(1e-5), '0 %'),
        (text.percent(0.003), '0.3 %'),
        (text.percent(0.42), '42 %'),
        (text.percent(0.998), '99.8 %'),
        (text.percent(1), '100 %'),
        (text.change(0.4, 0.1), '−75 %'),
        (text.change(0.4, 0.5), '+25 %'),
        (text.change(0.4, 0.4), '0 %'),
        (text.nats(32903.4), '32\u202f903'),
        (text.nats(1e-10), '0'),
        (text.nats(8.2), '8.20'),
    ],
)
def test_figures_as_in_print(said, shown):
    assert said == shown


def test_prose_escapes_and_sets_effects_apart():
    shown = str(text.prose('<b>coulomb_friction:pivot</b> & 0.4 -> 0.1'))
    assert '<b class="effect">coulomb_friction:pivot</b>' in shown
    assert shown.startswith('&lt;b&gt;') and '&amp; 0.4 → 0.1' in shown.replace('-&gt;', '→')


def test_a_unit_in_a_sentence_is_raised_whole():
    assert text.prose('d = 7 N m s2/rad2 at m2, 9.8 m/s2, 1 kg m2, 2 N m s/rad') == (
        'd = 7 N m s²/rad² at m2, 9.8 m/s², 1 kg m², 2 N m s/rad'
    )
