# SPDX-License-Identifier: Apache-2.0
"""From a finished search to all that an answer is told from."""

from dataclasses import FrozenInstanceError, replace

import pytest
from tests.searched import among, searched
from tests.simulate import record, TORQUE

from leo_diffmodel.explain.decide.verdict import decision
from leo_diffmodel.explain.findings.collect import collect
from leo_diffmodel.explain.problem.classes import Facts
from leo_sim.effects import place
from leo_sim.model import Model

MODEL, STEP = Model(TORQUE), 0.01


@pytest.fixture(scope='module')
def data():
    effects = [place(TORQUE, 'viscous_friction', 'pivot', b=0.05),
               place(TORQUE, 'bias_torque', 'pivot', t=0.2)]  # fmt: skip
    return [record(TORQUE, *effects, seconds=10)]


@pytest.fixture(scope='module')
def found(data):
    with pytest.MonkeyPatch.context() as patch:
        among(patch, MODEL, 'viscous_friction', 'bias_torque', 'coulomb_friction')
        return searched(data, MODEL)


@pytest.fixture(scope='module')
def findings(data, found):
    return collect(data, MODEL, found, Facts(TORQUE, False), STEP)


def test_each_effect_is_judged_beside_the_other(findings):
    labels = [part.candidate.label for part in findings.effects]
    assert sorted(labels) == ['bias_torque:pivot', 'viscous_friction:pivot']
    assert all(min(part.saved) > 20 and part.share == 1.0 for part in findings.effects)
    assert [label for label, _ in findings.ladder] == ['as given', *(f'+ {n}' for n in labels)]
    first, *_, last = (findings.headline.mean(figures) for _, figures in findings.ladder)
    assert last < 0.5 * first


def test_what_only_one_of_many_effects_can_do_is_asked_where_there_are_many(
    data, found, findings
):
    gates = replace(found.weight.settings, many=2)
    many = replace(found, weight=replace(found.weight, settings=gates))
    floors = collect(data, MODEL, many, Facts(TORQUE, False), STEP).floors
    assert findings.floors == () and len(floors) == 2 and min(floors) > 2


def test_findings_stay_as_they_are(findings):
    with pytest.raises(FrozenInstanceError):
        findings.rest = None
    assert decision(findings).verdict == 'named'
    assert decision(replace(findings, other='armature:pivot')).verdict == 'ambiguous'
