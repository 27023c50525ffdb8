# SPDX-License-Identifier: Apache-2.0
"""Whole windows in one compiled call give the numbers of the way by sample periods."""

import numpy as np
import pytest
from tests.models import modelled

from leo_sim.description.robot import load_robot
from leo_sim.dynamics import whole_windows, window_kernel
from leo_sim.effects import Effect, get_effect, Parameter, place, Placed
from leo_sim.laws.laws import TIME
from leo_sim.model import Model
from leo_sim.model.batch import History, rollout, warmed

RNG = np.random.default_rng(0)
WINDOWS, SAMPLES = 5, 9
SCAN = np.array([0.5, 1.0, 1.4])[:, None, None]
LAWS = {
    'nothing': (),
    'a scanned scale': (('torque_scale', {'k': SCAN}),),
    'two laws': (('viscous_friction', {'b': 0.01}), ('coulomb_friction', {'c': 0.05})),
    'scanned dry friction': (('coulomb_friction', {'c': 0.05 * SCAN}),),
    'a scanned rotor': (('armature', {'J': 0.01 * SCAN}),),
    'a clipped input': (('voltage_limit', {'v': 1.5}),),
    'scanned encoders': (('encoder_offset', {'o': 0.2 * SCAN}), ('encoder_scale', {'k': 1.1})),
    'laws asked in every substep': (
        ('joint_spring', {'k': 0.1 * SCAN, 'rest': 0.3}),
        ('stribeck_friction', {'c': 0.02, 'c_static': 0.05, 'v_s': 0.5}),
        ('torque_ripple', {'a': 0.05, 'n': 3.0, 'phase': 1.0}),
        ('quadratic_drag', {'d': 0.001}),
        ('viscous_friction', {'b': 0.01}),
    ),
    'friction by load': (
        ('load_dependent_friction', {'mu': 0.1 * SCAN}),
        ('torque_scale', {'k': 0.9}),
        ('coulomb_friction', {'c': 0.01}),
    ),
    'friction by load and speed': (
        ('stribeck_load_friction', {'mu': 0.1, 'mu_static': 0.1 + 0.1 * SCAN, 'v_s': 0.5}),
    ),
    'friction by a square of the load': (
        ('quadratic_load_friction', {'mu': 0.1 * SCAN, 'mu2': 0.05}),
    ),
    'friction by the way of power': (
        ('directional_load_friction', {'mu': 0.05, 'mu_back': 0.1 * SCAN}),
    ),
    'a push': (('voltage_push', {'v': 0.1 * SCAN}),),
    'a scanned delay': (
        ('command_delay', {'delay': 0.007 * SCAN}),
        ('torque_ripple', {'a': 0.05, 'n': 3.0, 'phase': 1.0}),
    ),
    'a lag behind a limit': (('actuator_lag', {'tau': 0.02}), ('voltage_limit', {'v': 1.5})),
    'rates that lag': (('velocity_lag', {'tau': 0.01 * SCAN}), ('quadratic_drag', {'d': 0.001})),
    'late readings': (('measurement_delay', {'delay': 0.012 * SCAN}),),
    'play in the gear': (('backlash', {'gap': 0.02 * SCAN}), ('coulomb_friction', {'c': 0.01})),
    'play, load and drag': (
        ('backlash', {'gap': 0.02}),
        ('load_dependent_friction', {'mu': 0.1}),
        ('quadratic_drag', {'d': 0.001 * SCAN}),
        ('viscous_friction', {'b': 0.01}),
    ),
}


def windows(robot):
    size, motors = len(robot.joint_names), len(robot.actuators)
    return {
        'q0': RNG.uniform(-0.5, 0.5, (WINDOWS, size)),
        'dq0': RNG.uniform(-2, 2, (WINDOWS, size)),
        'inputs': RNG.uniform(-2, 2, (WINDOWS, SAMPLES, motors)),
        'dt': RNG.uniform(0.004, 0.02, (WINDOWS, SAMPLES)),
        'enabled': RNG.random((WINDOWS, SAMPLES, motors)) < 0.7,
        'push': RNG.uniform(-0.1, 0.1, (WINDOWS, SAMPLES, size)),
    }


def whole(model, monkeypatch, **given):
    """Angles by whole windows; by sample periods they and the rates are the same."""
    assert whole_windows.possible(model.laws, given['q0'], given['inputs'])
    at_once = rollout(model, **given)
    with monkeypatch.context() as patch:
        patch.setattr(whole_windows, 'possible', lambda *_: False)
        one_by_one = rollout(model, **given)
    for mine, its in zip(at_once, one_by_one, strict=True):
        assert mine.shape == its.shape
        assert mine == pytest.approx(its, rel=1e-8, abs=1e-8)
    return at_once[0]


@pytest.mark.parametrize('effects', LAWS)
@pytest.mark.parametrize('name', ['pendulum', 'torque_pendulum', 'double_pendulum'])
def test_the_numbers_are_those_of_sample_periods(name, effects, monkeypatch):
    robot = load_robot(name)
    whole(modelled(robot, *LAWS[effects]), monkeypatch, **windows(robot))


@pytest.mark.filterwarnings('error')
def test_the_kernel_is_compiled_once_whatever_drives_the_robot():
    robot = load_robot('pendulum')
    given = windows(robot)
    plain = {'q0': given['q0'], 'dq0': given['dq0'], 'inputs': given['inputs'], 'dt': 0.01}
    rollout(Model(robot), **plain)
    rollout(modelled(robot, *LAWS['friction by load']), **given)
    rollout(modelled(robot, *LAWS['a scanned scale']), **given)
    rollout(modelled(robot, *LAWS['a scanned delay']), **plain)
    assert len(window_kernel.run.signatures) == 1


class Growing(Effect):
    """A torque, a dry friction or a share of the motor's torque that grows with time."""

    name, family, hook, parameters = 'growing', 'own', 'torque', (Parameter('a', 'N m'),)
    steady = True

    def __init__(self, dry=False, motor_side=False, timed=True):
        self.dry, self.motor_side, self.timed, self.remembers = dry, motor_side, timed, timed

    def torque(self, p, q, dq, motor, load, memory=1.0):
        grown = p['a'] * memory * np.ones_like(motor.torque)
        return grown * motor.torque if self.motor_side else grown

    def remember(self, p, q, dq, memory, dt):
        return memory + dt


@pytest.mark.parametrize('kind', [{}, {'dry': 1}, {'motor_side': 1}, {'dry': 1, 'timed': 0}])
def test_a_law_of_time_is_that_of_each_substep_whatever_went_before(kind, monkeypatch):
    robot, begin = load_robot('double_pendulum'), RNG.uniform(0.0, 2.0, WINDOWS)
    given = windows(robot)
    past = tuple(given[name][:, :4] for name in ('push', 'inputs', 'inputs', 'enabled', 'dt'))
    lags = [place(robot, f'{what}_lag', 'elbow', tau=0.02) for what in ('actuator', 'velocity')]
    model = Model(robot, (Placed(Growing(**kind), ('elbow',), {'a': 0.3 * SCAN}), *lags))
    moved = [whole(model, monkeypatch, start=begin + s, history=past, **given) for s in (0, 1)]
    assert (np.abs(moved[1] - moved[0]).max() > 1e-3) == model.laws.timed
    known, _ = warmed(model, History(*past), given['dq0'], {TIME: begin[:, None]})
    assert known[TIME][:, 0] == pytest.approx(begin)


def test_joints_come_to_rest_at_their_stops(monkeypatch):
    robot = load_robot('servo_pendulum')
    given = windows(robot) | {'dq0': np.full((WINDOWS, 1), 30.0), 'dt': 0.02, 'enabled': None}
    model = Model(robot)
    model.laws.stops = (np.array([-0.6]), np.array([0.6]))
    assert whole(model, monkeypatch, **given).max() == pytest.approx(0.6, abs=1e-3)


@pytest.mark.parametrize(
    ('effect', 'where', 'parameter'),
    [
        ('backlash', 'elbow', 'gap'),
        ('command_delay', 'all', 'delay'),
        ('velocity_lag', 'shoulder', 'tau'),
        ('measurement_delay', 'all', 'delay'),
    ],
)
def test_memories_go_on_from_the_samples_before(effect, where, parameter, monkeypatch):
    robot = load_robot('double_pendulum')
    given = windows(robot)
    angles, rates = RNG.uniform(-0.5, 0.5, (2, WINDOWS, 4, 2))
    past = angles, rates, given['inputs'][:, :4], None, np.full((WINDOWS, 4), 0.01)
    model = Model(robot, [place(robot, effect, where, **{parameter: 0.013})])
    angles = whole(model, monkeypatch, **given, history=past)
    assert np.abs(angles - rollout(Model(robot), **given)[0]).max() > 1e-3


def test_a_delay_behind_scanned_late_readings_goes_on_from_a_command_that_was_held(monkeypatch):
    robot = load_robot('pendulum')
    given = windows(robot)
    held, periods = np.full((WINDOWS, 4, 1), 2.0), np.full((1, 4), 0.01)
    past = *np.zeros((2, WINDOWS, 4, 1)), held, None, periods
    late = ('measurement_delay', {'delay': 0.013 * SCAN})
    model = modelled(robot, late, ('command_delay', {'delay': 0.02}))
    angles = whole(model, monkeypatch, **given, history=past)
    assert angles.shape == (3, WINDOWS, SAMPLES + 1, 1)


def test_scanned_delays_of_windows_that_begin_with_no_input(monkeypatch):
    """The command does not change at first, so that all delays give the same there."""
    robot = load_robot('torque_pendulum')
    given = windows(robot) | {'enabled': None}
    given['inputs'][:, 0] = 0.0
    model = Model(robot, [place(robot, 'command_delay', 'all', delay=0.013 * SCAN)])
    assert whole(model, monkeypatch, **given).shape == (3, WINDOWS, SAMPLES + 1, 1)


@pytest.mark.filterwarnings('error')
def test_constants_of_the_body_can_be_scanned(monkeypatch):
    robot = load_robot('double_pendulum')
    path = next(p for p in robot.constants if p.endswith('.mass'))
    model = Model(robot, constants={path: robot.constants[path].value * SCAN})
    angles = whole(model, monkeypatch, **windows(robot))
    assert angles.shape == (3, WINDOWS, SAMPLES + 1, 2)


def test_laws_of_one_joint_act_there_alone(monkeypatch):
    robot = load_robot('double_pendulum')
    drag = ('quadratic_drag', 'elbow', {'d': 0.01})
    model = modelled(robot, drag, ('load_dependent_friction', 'shoulder', {'mu': 0.1}))
    whole(model, monkeypatch, **windows(robot))


class Fading(Effect):
    """A torque law with a memory."""

    name, family, hook, remembers = 'fading', 'load', 'torque', True
    parameters = (Parameter('s', 'N m', role='amplitude'),)

    def torque(self, p, q, dq, motor, load, memory):
        return p['s'] * np.ones_like(q)


class Swirl(Effect):
    """A user's effect, whose law is not written as a function of numbers."""

    name, family, hook = 'swirl', 'load', 'torque'
    parameters = (Parameter('s', 'N m', role='amplitude'),)

    def torque(self, p, q, dq, motor, load):
        return p['s'] * np.cos(2 * q)


class Whirl(Swirl):
    """One whose law cannot be compiled."""

    name = 'whirl'

    @staticmethod
    def law(s, _a, _b, q, dq, motor, load):
        return s * sum({2: q}.popitem()) if isinstance(q, str) else s * np.linspace(q, q, 'one')


class Twirl(Swirl):
    """One whose law has a parameter too many to be compiled."""

    name = 'twirl'
    parameters = (*Swirl.parameters, *(Parameter(name, '') for name in 'abc'))

    @staticmethod
    def law(s, a, b, c, q, dq, motor, load):
        return s * np.cos(2 * q)


@pytest.mark.parametrize('effect', [Fading(), Swirl(), Whirl(), Twirl()])
def test_laws_that_remember_or_are_not_compiled_are_left_to_sample_periods(effect):
    robot = load_robot('pendulum')
    laws = Model(robot, [place(robot, effect, 'pivot', s=0.01)]).laws
    assert not whole_windows.possible(laws, np.zeros((1, 1)), np.zeros((1, 1, 1)))


def test_the_law_of_an_effect_file_is_compiled(tmp_path, monkeypatch):
    file = tmp_path / 'hose.py'
    file.write_text(HOSE)
    robot = load_robot('pendulum')
    given = windows(robot)
    model = Model(robot, [place(robot, get_effect(str(file)), 'pivot', k=0.01)])
    angles = whole(model, monkeypatch, **given)
    assert np.abs(angles - rollout(Model(robot), **given)[0]).max() > 1e-3


HOSE = """
import numpy as np
from leo_sim.effects import Effect, Parameter


class Hose(Effect):
    name, family, hook = 'hose', 'load', 'torque'
    parameters = (Parameter('k', 'N m/rad', low=0.0), Parameter('slack', 'rad'))
    looks_like = confused_with = reveal = 'A pull on one side.'

    @staticmethod
    def law(k, slack, _, q, dq, motor, load):
        return -k * np.maximum(q - slack, 0.0)
"""


NEAR = {
    'nothing': {},
    'friction': {'viscous_friction': {'b': 0.01}, 'coulomb_friction': {'c': 0.02}},
    'masses': {'link_mass': {'m': 0.05}, 'external_force': {'x': 0.3, 'z': -0.2}},
    'friction by load': {'load_dependent_friction': {'mu': 0.05}, 'link_com': {'x': 0.01}},
    'play and rotors': {'armature': {'J': 0.002}, 'backlash': {'gap': 0.05}},
}


def moved_apart(robot, effects, size, near):
    """Slopes of readings (rows, W, K + 1, 2J) by start states and parameters, in each way."""
    joints, rng = len(robot.joint_names), np.random.default_rng(5)
    names = [(effect, name) for effect, values in effects.items() for name in values]
    start = np.repeat(0.5 * rng.standard_normal((1, WINDOWS, 2 * joints)), 1 + 2 * joints, axis=0)
    start[1:] += size * np.eye(2 * joints)[:, None]
    start = np.concatenate([start, np.repeat(start[:1], len(names), axis=0)])
    scans = {(e, n): np.full((len(start), 1, 1), effects[e][n]) for e, n in names}
    for row, name in enumerate(names, 1 + 2 * joints):
        scans[name][row] += size
    values = {e: {n: scans[e, n] for n in v} for e, v in effects.items()}
    model = Model(robot, [place(robot, e, 'all', **v) for e, v in values.items()])
    inputs = 0.3 * rng.standard_normal((WINDOWS, SAMPLES, len(robot.actuators)))
    given = model, start[..., :joints], start[..., joints:], inputs, 0.01
    states = [np.concatenate(rollout(*given, near=n), axis=-1) for n in (False, *near)]
    return [(y[1:] - y[0]) / size for y in states]


@pytest.mark.parametrize('effects', NEAR.values(), ids=NEAR)
@pytest.mark.parametrize('name', ['pendulum', 'double_pendulum', 'so101'])
def test_motions_near_one_have_its_finite_differences(name, effects):
    along = whole_windows.Along()
    slopes, *others = moved_apart(load_robot(name), effects, 1e-6, (True, along, along))
    for near in others:
        scale = np.sqrt((slopes**2).mean(axis=(1, 2, 3), keepdims=True)) + 1e-6
        assert np.abs((near - slopes) / scale).max() < 5e-2
        assert np.sqrt((((near - slopes) / scale) ** 2).mean()) < 2e-3


def test_a_motion_kept_without_its_loads_does_not_serve_a_law_of_the_load():
    robot, along = load_robot('double_pendulum'), whole_windows.Along()
    given = np.zeros((2, 3, 2)), np.ones((2, 3, 2)), np.zeros((3, 4, 2)), 0.01
    scan = np.array([0.0, 0.1])[:, None, None]
    drag = Model(robot, [place(robot, 'quadratic_drag', 'elbow', d=scan)])
    rollout(drag, *given, near=along)
    loaded = Model(robot, [place(robot, 'load_dependent_friction', 'elbow', mu=scan)])
    later, alone = (rollout(loaded, *given, near=n) for n in (along, whole_windows.Along()))
    assert np.array_equal(later, alone)


def test_what_only_some_have_play_of_is_not_near(monkeypatch):
    robot, scan = load_robot('pendulum'), np.array([0.0, 0.05])[:, None, None]
    model = Model(robot, [place(robot, 'backlash', 'all', gap=scan)])
    given = np.zeros((2, 3, 1)), np.ones((2, 3, 1)), np.zeros((3, 4, 1)), 0.01
    assert np.array_equal(rollout(model, *given), rollout(model, *given, near=True))
