# SPDX-License-Identifier: Apache-2.0
"""leo check on a robot that hangs, stands and steps."""

from dataclasses import replace

import pytest
from tests.walker import did, LEO, SIGMA

from leo_diffmodel.check import traces
from leo_diffmodel.check.amplitudes import reaches
from leo_diffmodel.check.check import of_all, of_faults
from leo_diffmodel.check.excitation import excitation
from leo_diffmodel.check.pairs import hidden, nowhere
from leo_diffmodel.check.settings import CHECK
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.faults.find import faults_of
from leo_sim.model import Model

MODEL = Model(LEO, scheme='search')
BASE = LEO.base_joints


@pytest.fixture(scope='module')
def bags():
    return {name: did(name, seconds=5.0) for name in ('swinging', 'standing', 'stepping')}


def test_what_a_leg_does_between_two_samples_is_no_late_sensor(bags):
    found = [f for bag in bags.values() for f in of_faults(bag, faults_of(bag, MODEL))]
    assert len(found) >= 15 and all(f.severity == 'ok' for f in found), [f.what for f in found]


def test_a_base_that_is_held_is_not_asked_to_move(bags):
    alone = [bags['swinging']]
    ranges = excitation(alone, SIGMA[None], LEO)
    assert [row.joint for row in ranges] == list(LEO.joint_names[3:])
    found = of_all(alone, MODEL, SIGMA[None], ranges)
    assert not [f.what for f in found if f.what.startswith(BASE)]


def test_bags_are_judged_together(bags):
    together, sigma = list(bags.values()), SIGMA[None].repeat(3, axis=0)
    ranges = excitation(together, sigma, LEO)
    assert {f.severity for f in of_all(together, MODEL, sigma, ranges)} == {'ok'}
    alone = [bags['standing']]
    standing = of_all(alone, MODEL, SIGMA[None], excitation(alone, SIGMA[None], LEO))
    assert any(f.code == 'still' and 'stepping' in f.todo for f in standing)


def test_what_only_a_free_base_shows_is_hidden_in_a_held_one(bags, monkeypatch):
    wanted = ('link_mass:torso', 'viscous_friction:left_hip', 'encoder_offset:base_x')
    few = [c for c in candidates(MODEL) if c.label in wanted]
    monkeypatch.setattr(traces, 'candidates', lambda *_: few)
    monkeypatch.setattr(traces, 'CHECK', replace(CHECK, trace_windows_on_ground=20))
    found = {}
    for name in ('swinging', 'stepping'):
        data = traces.traces_of([bags[name]], MODEL)
        rows, _ = reaches(data, Facts(LEO, ever_free=False))
        found[name] = {row.label: row.detectable for row in rows}
        finding = hidden(rows, data.seconds, [bags[name]], MODEL)
        assert ('link_mass:torso' in finding.what) == (name == 'swinging')
        assert ('base was held' in finding.todo) == (name == 'swinging')
        assert nowhere(MODEL)[0] not in finding.what
    assert found['swinging']['link_mass:torso'] is None and found['stepping']['link_mass:torso']
    assert found['swinging']['viscous_friction:left_hip'] < 0.05
