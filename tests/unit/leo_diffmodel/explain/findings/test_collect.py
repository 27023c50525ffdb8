# SPDX-License-Identifier: Apache-2.0
"""From a finished search to all findings."""

from dataclasses import replace

import numpy as np
import pytest
from tests.searched import among, searched
from tests.simulate import record, TORQUE

from leo_diffmodel.explain.decide import decision
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.findings.collect import collect
from leo_diffmodel.explain.findings.findings import Contender
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.rows import rows
from leo_diffmodel.explain.select.evidence import score
from leo_sim.effects import place
from leo_sim.model import Model

MODEL, STEP = Model(TORQUE), 0.01


EFFECTS = (
    place(TORQUE, 'viscous_friction', 'pivot', b=0.05),
    place(TORQUE, 'bias_torque', 'pivot', t=0.2),
)


@pytest.fixture(scope='module')
def data():
    return [record(TORQUE, *EFFECTS, seconds=10)]


@pytest.fixture(scope='module')
def found(data):
    with pytest.MonkeyPatch.context() as patch:
        among(patch, MODEL, 'viscous_friction', 'bias_torque', 'coulomb_friction')
        return searched(data, MODEL)


@pytest.fixture(scope='module')
def findings(data, found):
    return collect(data, MODEL, found, Facts(TORQUE, False), STEP)


def test_each_effect_is_judged_next_to_the_other(findings):
    labels = [part.candidate.label for part in findings.effects]
    assert sorted(labels) == ['bias_torque:pivot', 'viscous_friction:pivot']
    assert all(min(part.saved) > 20 and part.share == 1.0 for part in findings.effects)
    assert [label for label, _ in findings.ladder] == ['as given', *(f'+ {n}' for n in labels)]
    first, *_, last = (findings.headline.mean(figures) for _, figures in findings.ladder)
    assert last < 0.5 * first


def test_what_only_one_of_many_effects_can_do_is_asked_where_there_are_many(data, found, findings):
    gates = replace(found.weight.gates, many=2)
    many = replace(found, weight=replace(found.weight, gates=gates))
    floors = collect(data, MODEL, many, Facts(TORQUE, False), STEP).floors
    assert findings.floors == () and len(floors) == 2 and min(floors) > 2


def test_what_is_named_is_no_effect_that_could_not_be_tested(findings):
    scans = tuple(replace(s, evidence=0.0) for s in findings.search.scans)
    unseen = replace(findings, search=replace(findings.search, scans=scans))
    assert [row['name'] for row in rows(unseen, ())['not_testable']] == ['coulomb_friction']


def test_an_answer_with_a_rival_is_ambiguous(findings):
    assert decision(findings).verdict == 'named'
    both = tuple(part.candidate.label for part in findings.effects)
    rivalled = replace(findings, others=(Contender('armature:pivot', 9.0, both),))
    assert decision(rivalled).verdict == 'ambiguous'


def test_what_is_in_doubt_stands_beside_what_is_sure(findings):
    first, second = findings.effects
    decided = decision(replace(findings, effects=(first, replace(second, share=0.5))))
    assert decided.verdict == 'partly' and decided.beside == [second.candidate.label]
    row = rows(findings, decided.beside)
    assert [r['name'] for r in row['effects']] == [first.candidate.effect.name]
    assert [r['name'] for r in row['not_sure']] == [second.candidate.effect.name]


def test_a_choice_that_compare_would_refute_is_corrected_or_not_sure(data, monkeypatch):
    """Coulomb friction alone, where the two effects that do act were fitted as well.

    Where the folds surely say otherwise two measures disagree.
    """
    among(monkeypatch, MODEL, 'viscous_friction', 'bias_torque', 'coulomb_friction')
    held = [record(TORQUE, *EFFECTS, seconds=10, seed=7)]
    found = searched(data, MODEL, hold_out=held)
    right = collect([*data, *held], MODEL, found, Facts(TORQUE, False), STEP)
    assert not right.refuting and decision(right).verdict == 'named'
    other = next(c for c in candidates(MODEL) if c.label == 'coulomb_friction:pivot')
    less = score(Estimate(found.posed, fit(found.problem, Hypothesis((other,)), np.array([0.1]))))

    def judged(**gates):
        own = replace(found.weight, gates=replace(found.weight.gates, **gates))
        wrong = replace(found, chosen=less, final=less.fit, weight=own)
        return collect([*data, *held], MODEL, wrong, Facts(TORQUE, False), STEP)

    mine = 'bias_torque:pivot + viscous_friction:pivot'
    corrected = judged().search
    assert corrected.chosen.names == found.chosen.names and not judged().refuting
    assert ' + '.join(sorted(c.label for c in corrected.final.hypothesis.candidates)) == mine
    folds_say_so = {'least_errors': -np.inf}
    wrong = judged(**folds_say_so)
    assert wrong.search.chosen is less and wrong.refuting[0].label == mine
    assert decision(replace(wrong, unknown=None)).verdict != 'named'
    assert not (judged(surely=1.0, **folds_say_so).refuting or judged(likely=1.0).refuting)
    assert not judged(fewest_blocks=10**6, **folds_say_so).refuting


def test_what_did_not_converge_is_not_sure(findings):
    assert findings.final.certificate.converged and findings.final.certificate.reached > 1
    lost = replace(findings.final.certificate, converged=False)
    search = replace(findings.search, final=replace(findings.final, certificate=lost))
    assert decision(replace(findings, search=search)).verdict == 'ambiguous'


def test_without_time_to_look_for_a_law_the_answer_is_open(data, found):
    late = replace(found, posed=found.posed.before(0.0))
    findings = collect(data, MODEL, late, Facts(TORQUE, False), STEP)
    assert findings.search.untried == ('a law that is no known effect',)
    assert decision(findings).verdict == 'ambiguous'
