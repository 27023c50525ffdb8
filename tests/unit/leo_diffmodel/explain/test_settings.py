# SPDX-License-Identifier: Apache-2.0
"""The gates of explain: few, all in one place, each told what it decides."""

from dataclasses import fields
import re

from leo_diffmodel.explain.settings import SETTINGS, Settings

MOST = 40


def test_there_are_few_gates_and_each_has_its_line():
    names = [f.name for f in fields(Settings)]
    described = re.findall(r'^ {8}(\w+): \S', Settings.__doc__ or '', re.MULTILINE)
    assert 10 < len(names) <= MOST
    assert described == names


def test_the_gates_are_told_by_name_and_value():
    told = SETTINGS.to_json()
    assert told == {f.name: getattr(SETTINGS, f.name) for f in fields(Settings)}
    assert all(isinstance(v, int | float) and v > 0 for v in told.values())
