# SPDX-License-Identifier: Apache-2.0
"""Supply and temperature of a motor are read back from its recordings."""

import numpy as np

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.datasheet.sheet import conditions
from leo_diffmodel.datasheet.words import figures

T = np.array([0.0, 0.1, 0.2])
SHEET = {'not_known': [], 'constants': {}, 'others': [], 'not_needed': [], 'given': {}}


def recorded(folder, **measured):
    inputs = {'pivot': {'voltage': np.zeros(3), **measured}}
    write_runs(folder, [Run(T, ['pivot'], np.zeros((3, 1)), inputs=inputs)], {})
    return str(folder)


def test_what_the_motor_measured_stands_in_the_sheet(tmp_path):
    volts, degrees = np.array([12.0, 11.0, 11.5]), np.array([30.0, np.nan, 42.0])
    warm = recorded(tmp_path / 'warm', supply_voltage=volts, temperature=degrees)
    first, second = rows = conditions([warm, recorded(tmp_path / 'bare')], 'pivot')
    assert first['supply'] == {'first': 12.0, 'last': 11.5, 'least': 11, 'most': 12, 'unit': 'V'}
    assert first['temperature']['last'] == 42.0
    assert second == {'bag': 'bare'}
    names, values, _ = zip(*figures(SHEET | {'conditions': rows}), strict=True)
    assert names == ('supply in warm', 'temperature in warm')
    assert values[1] == '30.0\u00a0°C to 42.0\u00a0°C'


def test_another_motor_is_left_out(tmp_path):
    bag = recorded(tmp_path / 'bag', temperature=np.array([30.0, 31.0, 32.0]))
    assert conditions([bag], 'elbow') == [{'bag': 'bag'}]
