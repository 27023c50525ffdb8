# SPDX-License-Identifier: Apache-2.0
"""Which effects are candidates: those of other packages, too; none that cannot show."""

from argparse import Namespace
from dataclasses import replace

import pytest
from tests.simulate import PENDULUM, record

from leo_diffmodel.explain.problem.candidates import candidates, seen, unseen
from leo_diffmodel.verbs.common import own_effects
from leo_sim.description.robot import load_robot
from leo_sim.effects import get_effect, place
from leo_sim.model import Model

EFFECT = """
from leo_sim.effects.base import Effect, Parameter


class BearingDrag(Effect):
    name = 'bearing_drag'
    family = 'friction'
    hook = 'torque'
    parameters = (Parameter('c', 'N m s3/rad3', low=0.0),)

    def torque(self, p, q, dq, motor, load):
        return -p['c'] * dq**3
"""


def test_an_entry_point_is_enough(tmp_path, monkeypatch):
    facts = tmp_path / 'bearings-1.dist-info'
    facts.mkdir()
    (facts / 'METADATA').write_text('Metadata-Version: 2.1\nName: bearings\nVersion: 1\n')
    (facts / 'entry_points.txt').write_text('[leo.effects]\nbearing_drag = bearings:BearingDrag\n')
    (tmp_path / 'bearings.py').write_text(EFFECT)
    monkeypatch.syspath_prepend(tmp_path)

    robot = load_robot('pendulum')
    tried = candidates(Model(robot), own_effects(Namespace(effect=[])))
    assert ('bearing_drag', 'pivot') in {(c.effect.name, c.where) for c in tried}
    assert get_effect('bearing_drag').family == 'friction'
    assert place(robot, 'bearing_drag', 'all', c=1e-6).where == ('pivot',)


@pytest.mark.parametrize('rates', ['absent', 'made', 'measured'])
def test_a_speed_that_nobody_measured_has_no_lag(rates):
    log = replace(record(PENDULUM, seconds=2), rates=rates)
    tried, left = (
        {c.effect.name for c in which(Model(PENDULUM), [log])} for which in (seen, unseen)
    )
    assert ('velocity_lag' in tried) == (rates == 'measured') == (left == set())
    everything = {c.effect.name for c in candidates(Model(PENDULUM))}
    assert 'command_delay' in tried and tried | left == everything
