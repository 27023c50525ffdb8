# SPDX-License-Identifier: Apache-2.0
"""Which effects are candidates: those of other packages, too; none that cannot show.

Their parameters stay within what the robot makes plausible, also one whose sizes are no distances.
"""

from argparse import Namespace
from dataclasses import replace

import numpy as np
import pytest
from tests.bearing_drag import BEARING_DRAG
from tests.robots import FLYWHEEL
from tests.simulate import PENDULUM, record, TORQUE

from leo_diffmodel.compare import sizes
from leo_diffmodel.explain.problem.candidates import at_limit, candidates, limited, seen
from leo_diffmodel.explain.problem.hypothesis import compatible
from leo_diffmodel.explain.settings import SETTINGS
from leo_diffmodel.verbs.common import own_effects
from leo_sim.description.robot import load_robot
from leo_sim.effects import EFFECTS, get_effect, place
from leo_sim.model import Model


def test_an_entry_point_is_enough(tmp_path, monkeypatch):
    facts = tmp_path / 'bearings-1.dist-info'
    facts.mkdir()
    (facts / 'METADATA').write_text('Metadata-Version: 2.1\nName: bearings\nVersion: 1\n')
    (facts / 'entry_points.txt').write_text('[leo.effects]\nbearing_drag = bearings:BearingDrag\n')
    (tmp_path / 'bearings.py').write_text(BEARING_DRAG)
    monkeypatch.syspath_prepend(tmp_path)

    robot = load_robot('pendulum')
    tried = candidates(Model(robot), own_effects(Namespace(effect=[])))
    assert ('bearing_drag', 'pivot') in {(c.effect.name, c.where) for c in tried}
    assert get_effect('bearing_drag').family == 'speed-dependent loss'
    assert place(robot, 'bearing_drag', 'all', c=1e-6).where == ('pivot',)


@pytest.mark.parametrize('rates', ['absent', 'made', 'measured'])
def test_a_speed_that_nobody_measured_has_no_lag(rates):
    log = replace(record(PENDULUM, seconds=2), rates=rates)
    tried, everything = seen(Model(PENDULUM), [log]), candidates(Model(PENDULUM))
    left = {c.effect.name for c in everything if c not in tried}
    assert ('velocity_lag' in left) == (rates != 'measured') == (left != set())
    assert all(c.effect.of_rates for c in everything if c not in tried)
    assert 'command_delay' in {c.effect.name for c in tried} and {*tried} <= {*everything}


ROBOTS = [PENDULUM, TORQUE, load_robot('servo_pendulum'), load_robot('leo')]


def bounded(name, low, high):
    """The first parameter of an effect of the torque pendulum within these bounds."""
    return replace(EFFECTS[name].parameters_for(TORQUE, ('pivot',))[0], low=low, high=high)


SIGNED = bounded('bias_torque', -6.0, 6.0)
POSITIVE = bounded('coulomb_friction', 0.0, 6.0)
SCALE = bounded('torque_scale', 0.2, 5.0)


def plausible(robot, **options):
    """Parameters of all candidates of a robot by effect, place and name, within their limits."""
    model = Model(robot, **options)
    return {
        (c.effect.name, c.where, p.name): p
        for c in candidates(model)
        for p in limited(c, model, SETTINGS.grids).parameters
    }


@pytest.mark.parametrize('robot', ROBOTS, ids=lambda r: r.name)
def test_limits_are_the_robots_and_never_wider_than_the_effects(robot):
    found = plausible(robot)
    joint = robot.actuators[0].joint
    torque = max(sizes.stall_torque(robot, joint), sizes.gravity_scale(robot))
    assert found['coulomb_friction', joint, 'c'].high == pytest.approx(torque)
    bias = found['bias_torque', joint, 't']
    assert (bias.low, bias.high) == pytest.approx((-torque, torque))
    link = robot.moving_links[0]
    mass = found['link_mass', link, 'm']
    own = robot.constants[f'links.{link}.mass'].value
    assert -own < mass.low < 0 < mass.high == pytest.approx(5 * sizes.mass_scale(robot))
    assert found['link_com', link, 'x'].high == pytest.approx(sizes.reach(robot))
    scale = found['torque_scale', joint, 'k']
    assert (scale.low, scale.high) == SETTINGS.grids.gain
    assert found['joint_spring', joint, 'rest'].high == SETTINGS.grids.rest
    pool = candidates(Model(robot))
    declared = {(c.effect.name, c.where, p.name): p for c in pool for p in c.parameters}
    for key, p in found.items():
        given = declared[key]
        assert given.low <= p.low < p.high <= given.high, key
        assert p.neutral <= p.high and (p.low <= p.neutral or given.low == p.neutral), key
        assert p == replace(given, low=p.low, high=p.high)


def test_a_stronger_robot_may_have_more_friction():
    most = [plausible(r)['coulomb_friction', 'pivot', 'c'].high for r in ROBOTS[:3]]
    assert most[0] < most[2] < most[1]


def test_a_motor_may_have_several_times_the_inertia_that_it_moves():
    arm, servos = (plausible(load_robot(name)) for name in ('double_pendulum', 'so101'))
    own, link = Model('so101').laws.rotor_inertia, load_robot('double_pendulum')
    assert arm['armature', 'elbow', 'J'].high > 2 * 5 * sizes.inertia_scale(link)
    for where in ('all', 'gripper'):
        assert servos['armature', where, 'J'].high > 5 * own.max()
    assert servos == plausible(load_robot('so101'))
    model = Model('so101')
    armatures = {c.where: c for c in candidates(model) if c.effect.name == 'armature'}
    shared, one = (limited(armatures[w], model, SETTINGS.grids) for w in ('all', 'gripper'))
    assert not compatible([shared], one)


def test_a_model_says_otherwise_at_one_place_or_all():
    own = {'coulomb_friction.c': (0.0, 0.01), 'link_mass:bob.m': (-0.02, 0.03)}
    found = plausible(TORQUE, limits=own)
    assert found['coulomb_friction', 'pivot', 'c'].high == 0.01
    assert found['link_mass', 'bob', 'm'].high == 0.03
    assert found['bias_torque', 'pivot', 't'] == plausible(TORQUE)['bias_torque', 'pivot', 't']


def test_an_effect_of_the_limits_keeps_its_law_and_place():
    model = Model(TORQUE)
    for c in candidates(model):
        kept = limited(c, model, SETTINGS.grids)
        assert (kept.effect, kept.where) == (c.effect, c.where)
        assert limited(kept, model, SETTINGS.grids) == kept


@pytest.mark.parametrize(
    ('parameter', 'low', 'high', 'reached'),
    [
        (SIGNED, 6.0, 6.0, True),
        (SIGNED, -6.0, -6.0, True),
        (SIGNED, 5.7, 6.1, True),
        (SIGNED, 5.85, 5.95, False),
        (SIGNED, 1.0, 6.0, True),
        (SIGNED, -1.0, 5.0, False),
        (POSITIVE, -0.1, 0.1, False),
        (POSITIVE, 5.85, 6.05, True),
        (SCALE, 0.9, 1.1, False),
        (SCALE, 0.19, 0.23, True),
        (replace(SCALE, high=1.0), 0.9, 1.1, False),
        (replace(POSITIVE, high=np.inf), -3.0, 15.0, False),
    ],
)
def test_a_value_at_a_limit_is_seen_but_no_effect_is_no_limit(parameter, low, high, reached):
    assert at_limit(parameter, low, high) == reached


@pytest.mark.parametrize('motor', [True, False], ids=['motor', 'passive'])
@pytest.mark.parametrize('gravity', [9.81, 0.0])
def test_a_wheel_whose_mass_is_on_its_axis_has_a_size(motor, gravity):
    wheel = FLYWHEEL if motor else replace(FLYWHEEL, input='torque', actuators=())
    robot = wheel.with_constants({'gravity': replace(wheel.constants['gravity'], value=gravity)})
    found = {(name, p): value for (name, _, p), value in plausible(robot).items()}
    assert all(p.low < p.high for p in found.values())
    radius = np.sqrt(4e-4 / 0.5)
    assert found['link_com', 'x'].high == pytest.approx(radius)
    most = found['coulomb_friction', 'c'].high
    assert most == pytest.approx(0.32 if motor else 0.5 * 9.81 * radius)
    assert (sizes.push_scale(robot) > 0).all()


@pytest.mark.parametrize(
    ('robot', 'offered'), [('torque_pendulum', False), ('double_pendulum', True), ('leo', False)]
)
def test_a_payload_is_offered_where_it_is_another_thing_than_its_parts(robot, offered):
    assert offered == any(c.effect.name == 'payload' for c in candidates(Model(robot)))


def test_what_a_model_has_everywhere_is_not_offered_again():
    robot = load_robot('double_pendulum')
    held = [place(robot, name, 'all') for name in ('gravity', 'viscous_friction')]
    offered = {(c.effect.name, c.where) for c in candidates(Model(robot, held))}
    everywhere = {name for name, where in offered if where == 'all'}
    assert 'coulomb_friction' in everywhere
    assert not everywhere & {'gravity', 'viscous_friction'}
