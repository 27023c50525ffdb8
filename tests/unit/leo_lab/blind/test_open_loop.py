# SPDX-License-Identifier: Apache-2.0
"""How large an effect is in a run, and which effects are drawn."""

from types import SimpleNamespace

import numpy as np
import pytest

from leo_diffmodel.explain.problem.candidates import candidates
from leo_lab.blind import drawn, open_loop
from leo_lab.blind.case import draw_case
from leo_lab.blind.open_loop import OpenLoop, Run, sized
from leo_lab.blind.scenes import Given
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model


@pytest.mark.parametrize('torque, likely', [(2.0, True), (20.0, False)])
def test_no_torque_drawn_for_a_walker_is_more_than_its_motors_can_give(torque, likely):
    leo = load_robot('leo')
    loop = SimpleNamespace(robot=leo, rates=np.ones(9))
    ripple = place(leo, 'torque_ripple', 'left_hip', a=torque, n=8.0, phase=0.0)
    assert open_loop._moves(loop, loop, ripple) == likely
    assert not open_loop._moves(SimpleNamespace(robot=leo, rates=np.zeros(9)), loop, ripple)


@pytest.mark.parametrize('x, likely', [(0.3, True), (-3.0, False)])
def test_no_mass_drawn_for_a_walker_is_farther_off_than_it_reaches(x, likely):
    leo = load_robot('leo')
    moved = place(leo, 'link_com', 'right_shank', x=x, z=0.1)
    assert open_loop._within(SimpleNamespace(robot=leo), moved) == likely


def servo_run() -> Run:
    robot = load_robot('servo_pendulum')
    inputs = np.repeat(np.random.default_rng(3).uniform(-5, 5, (40, 1)), 25, axis=0)
    scene = Given(inputs, np.ones(inputs.shape, dtype=bool))
    return Run(robot, (scene,), (1e-3, 0.05))


def test_what_uncertain_constants_explain_is_no_effect():
    run = servo_run()
    first = OpenLoop(run, ())
    assert sized(run, first, (), 'armature', 'pivot', 10.0, 1) is None
    assert sized(run, first, (), 'encoder_offset', 'pivot', 10.0, 1) is None
    placed, size = sized(run, first, (), 'coulomb_friction', 'pivot', 10.0, 1)
    assert placed.effect.name == 'coulomb_friction'
    assert size == pytest.approx(10.0, rel=0.2)


@pytest.fixture(scope='module')
def position_run() -> Run:
    return draw_case(9090, 'none', 'xl330_pendulum').run


def test_what_constants_of_a_servo_that_counts_explain_is_no_effect(position_run):
    """Another motor and another zero stand for a force; its loop is flat between two counts."""
    force = place(position_run.robot, 'external_force', 'weight', x=-0.06, z=0.44)
    loop = OpenLoop(position_run, (force,))
    assert np.abs(loop._change(force)).max() > 10.0
    assert loop.left(force) < 0.1
    assert not loop.shows(force)


def test_a_size_of_which_constants_can_explain_a_good_part_does_not_show(position_run):
    drag = place(position_run.robot, 'viscous_friction', 'pivot', b=0.05)
    loop = OpenLoop(position_run, (drag,))
    assert loop.shows(drag)
    loop.size = lambda placed: np.array([2.0 * loop.left(placed)])
    assert not loop.shows(drag)


@pytest.mark.parametrize('v_s, apart', [(2.0, True), (1e-3, False)])
def test_a_law_that_is_wider_at_speeds_that_never_come_does_no_more_than_the_narrower(v_s, apart):
    run, pool = servo_run(), candidates(Model(load_robot('servo_pendulum')))
    wide = place(run.robot, 'stribeck_friction', 'pivot', c=0.01, c_static=0.02, v_s=v_s)
    narrower = [c for c in pool if c.effect.name == 'coulomb_friction']
    assert drawn._wide(run, wide, (), narrower) == apart
    assert drawn._wide(run, wide, (), [])


def test_noise_floors_of_a_loop_that_jumps_are_of_the_size_of_its_noise(position_run):
    pair = tuple(
        place(position_run.robot, name, 'pivot', v=v)
        for name, v in (('voltage_push', 2.6), ('voltage_deadband', 2.3))
    )
    angle, rate = OpenLoop(position_run, pair, pair[:1])._floor
    assert angle < 0.05 and rate < 0.5
