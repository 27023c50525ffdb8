# SPDX-License-Identifier: Apache-2.0
"""Lines are a budget: what a feature adds is deleted elsewhere."""

from benchmarks.house import BUDGET, rooms, sums
from tests.places import ROOT
import yaml


def test_source_and_tests_stay_within_their_budget() -> None:
    budget, now = yaml.safe_load(BUDGET.read_text()), sums(rooms(ROOT))
    grown = {name: (lines, budget[name]) for name, lines in now.items() if lines > budget[name]}
    assert not grown, f'lines and their budget: {grown}; delete elsewhere what this added'
