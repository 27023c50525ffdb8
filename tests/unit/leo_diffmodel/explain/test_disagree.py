# SPDX-License-Identifier: Apache-2.0
"""Bags that ask for different values are said to disagree."""

from dataclasses import replace
from pathlib import Path

import pytest
from tests.searched import among
from tests.simulate import record, TORQUE

from leo_diffmodel.explain.explanation import explain
from leo_sim.effects import place
from leo_sim.model import Model

SECONDS = 10


@pytest.fixture(autouse=True)
def _few(monkeypatch):
    laws = 'coulomb_friction viscous_friction stribeck_friction bias_torque torque_scale'
    among(monkeypatch, Model(TORQUE), *laws.split())


def _recorded(friction: float, seed: int):
    placed = place(TORQUE, 'coulomb_friction', 'pivot', c=friction)
    recording = record(TORQUE, placed, seconds=SECONDS, seed=seed)
    return replace(recording, path=Path(f'run_{seed}'))


@pytest.mark.parametrize(('frictions', 'agree'), [((0.2, 0.2), True), ((0.1, 0.4), False)])
def test_two_bags_with_other_friction_disagree(frictions, agree):
    recordings = [_recorded(c, seed) for seed, c in enumerate(frictions, start=1)]
    answer = explain(recordings, Model(TORQUE))
    assert ('the bags disagree about' in answer.sentence) is not agree
    if agree:
        assert answer.sentence.startswith('Missing: coulomb_friction:pivot')
    else:
        assert answer.verdict in ('ambiguous', 'unknown')
        assert 'in run_1 and' in answer.sentence
