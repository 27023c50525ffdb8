# SPDX-License-Identifier: Apache-2.0
"""Angles, speeds and loads of an answer are those of its windows, at the joints it is about."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.robots import CART
from tests.simulate import record, TORQUE

from leo_diffmodel.compare.windows import cut
from leo_diffmodel.explain.findings.parts import rivals, shown_for
from leo_diffmodel.explain.problem.candidates import candidates, limited
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.description.robot import load_robot
from leo_sim.model import Model


def shown(robot, data, *labels):
    pool = [c for c in candidates(Model(robot)) if c.label in labels]
    assert len(pool) == len(labels)
    return shown_for(cut(data, 0.3), Model(robot), pool, Facts(robot, False))


def test_the_ranges_are_those_of_all_recordings():
    data = [record(TORQUE, seed=seed, seconds=6) for seed in (1, 2)]
    q, dq = (np.concatenate([getattr(r.episodes[0], n) for r in data]) for n in ('q', 'dq'))
    (each,) = shown(TORQUE, data, 'coulomb_friction:pivot')
    (first,) = shown(TORQUE, data[:1], 'coulomb_friction:pivot')
    units = [getattr(each, name).unit for name in ('angle', 'speed', 'load')]
    assert (each.joint, units) == ('pivot', ['rad', 'rad/s', 'N m'])
    assert each.angle[:2] == pytest.approx(np.percentile(q, (1, 99)), rel=0.1)
    assert each.speed[:2] == pytest.approx(np.percentile(dq, (1, 99)), rel=0.1)
    assert np.ptp(each.speed[:2]) > np.ptp(first.speed[:2])


def test_the_load_is_what_the_gear_carries():
    """Nothing where it hangs free, the motor's torque and more where that holds it up."""
    held = record(TORQUE, inputs=np.full((300, 1), 1.0), seconds=3, noise=(0.0, 0.0))
    free = record(TORQUE, inputs=np.zeros((300, 1)), seconds=3, noise=(0.0, 0.0))
    (loaded,), (idle,) = (shown(TORQUE, [r], 'coulomb_friction:pivot') for r in (held, free))
    assert idle.load.high < 1e-6 < 1.0 < loaded.load.high


def test_only_joints_where_the_effects_act_are_shown():
    robot = load_robot('double_pendulum')
    windows = cut([record(TORQUE, seconds=3)], 0.3)
    names = ('q', 'dq', 'inputs', 'enabled')
    both = replace(windows, **{n: np.repeat(getattr(windows, n), 2, axis=-1) for n in names})
    pool, facts = candidates(Model(robot)), Facts(robot, False)

    def joints(label):
        found = [c for c in pool if c.label == label]
        return [s.joint for s in shown_for(both, Model(robot), found, facts)]

    assert joints('coulomb_friction:elbow') == ['elbow']
    assert joints(f'link_mass:{robot.moving_links[0]}') == ['shoulder']
    assert joints('coulomb_friction:all') == ['shoulder', 'elbow']


def test_a_slide_has_its_own_units():
    (each,) = shown(CART, [record(CART, seconds=3)], 'viscous_friction:rail')
    assert (each.angle.unit, each.speed.unit, each.load.unit) == ('m', 'm/s', 'N')


def test_what_stands_in_place_of_an_effect_may_stand_beside_other_names_of_the_rest():
    """On a single hinge a force and a shifted centre of mass turn gravity alike.

    A spring that rests as far away as it may is a constant torque, and no rival.
    """
    model = Model(TORQUE)
    able = (limited(c, model, SETTINGS.grids) for c in candidates(model) if c.where != 'all')
    pool = {c.effect.name: c for c in able}
    far = SimpleNamespace(own=lambda c: [p.high for p in c.parameters])

    def known(behind, *names):
        return SimpleNamespace(names=frozenset(pool[n] for n in names), behind=behind, fit=far)

    mine = known(0.0, 'torque_scale', 'external_force')
    sets = [
        mine,
        known(0.5, 'armature', 'link_com'),
        known(0.7, 'armature', 'external_force'),
        known(0.8, 'joint_spring', 'external_force'),
        known(0.9, 'coulomb_friction', 'bias_torque'),
        known(1.0, 'link_mass', 'external_force'),
        known(1e4, 'viscous_friction', 'link_com'),
    ]
    weight = SimpleNamespace(gates=SETTINGS.gates, ahead=lambda _, s: s.behind)
    found = SimpleNamespace(sets=sets, chosen=mine, weight=weight)
    told = [*rivals(found, pool['torque_scale'], Facts(TORQUE, False))]
    near = [('armature', 0.5), ('link_mass', 1.0)]
    assert [(r.candidate.effect.name, r.behind) for r in told] == near
    assert not [*rivals(found, pool['external_force'], Facts(TORQUE, False))]
    both = known(0.0, 'external_force', 'torque_ripple')
    beside = [both, known(0.5, 'link_com', 'torque_ripple')]
    found = SimpleNamespace(sets=beside, chosen=both, weight=weight)
    (told,) = rivals(found, pool['external_force'], Facts(TORQUE, False))
    assert told.candidate == pool['link_com']
