# SPDX-License-Identifier: Apache-2.0
"""LEO on the ground: hand calculations, engines, effects, purity."""

import hashlib
import subprocess
import sys

import numpy as np
import pytest
from tests.models import modelled, stepped

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.dynamics import multirate
from leo_sim.dynamics.spatial import Single
from leo_sim.effects import EFFECTS, place
from leo_sim.model import Model, State
from leo_sim.model.batch import rollout

ROBOTS = {name: load_robot(name) for name in ('leo', 'leo_ode')}
FREE = np.zeros(6, dtype=bool)
PROGRAM = """
import sys; sys.path.insert(0, {folder!r})
from test_contact import digest, pairs
print(digest(pairs()[:20]))
"""


def walked(model, steps=12, seed=0):
    """States and voltages of a robot that staggers under random voltages."""
    rng, state, found = np.random.default_rng(seed), model.start(), []
    for _ in range(steps):
        volts = rng.uniform(-5, 5, 6)
        found.append((state, volts))
        state = model.step(state, volts, 0.03)
    return found


def pairs():
    model = Model('leo', engine='rigid', scheme='training')
    return walked(model, 20, 0) + walked(model, 20, 1)


def digest(given):
    model, hashed = Model('leo', scheme='training'), hashlib.sha256()
    for state, volts in given:
        after = model.step(state, volts, 0.03)
        hashed.update(after.q.tobytes() + after.dq.tobytes())
    return hashed.hexdigest()


@pytest.mark.parametrize('engine', ['pybullet', 'rigid'])
def test_free_fall_keeps_horizontal_momentum_and_loses_height_by_the_book(engine):
    model = Model('leo', engine=engine)
    mass = sum(body.mass for body in model.laws.bodies.values())
    assert mass == pytest.approx(1.857022, abs=1e-5)
    start = model.start()
    rates = np.random.default_rng(0).normal(0, 1, 9)
    state = State(start.q + np.array([0, 1, 0, 0, 0, -0.3, 0, 0, 0]), rates)
    after = model.step(state, np.zeros(6), 0.03, enabled=FREE)
    gained = (
        model.rigid.mass_and_bias(after.q, after.dq)[0] @ after.dq
        - model.rigid.mass_and_bias(state.q, state.dq)[0] @ state.dq
    )
    assert gained[0] == pytest.approx(0, abs=1e-6)
    assert gained[1] == pytest.approx(-mass * 9.81 * 0.03, abs=2e-6)


def test_standing_robot_rests_on_its_feet():
    model = Model('leo', engine='rigid')
    state = model.start('standing')
    for _ in range(60):
        volts = 80.0 * (model.start('standing').q - state.q)[3:]
        state = model.step(state, np.clip(volts, -8.6, 8.6), 0.03)
    forces = model.contact_forces(state)
    feet = [force for name, force in forces.items() if 'heel' in name or 'toe' in name]
    assert sum(feet) == pytest.approx(1.857022 * 9.81, rel=0.02)
    assert sum(forces.values()) == pytest.approx(sum(feet))
    assert abs(state.q[0]) < 0.02


def test_held_base_stays_where_it_hangs():
    model = Model('leo', engine='rigid')
    start = model.start('hanging')
    after = model.step(start, np.full(6, 3.0), 0.1)
    assert after.q[:3].tolist() == start.q[:3].tolist()
    assert np.abs(after.q - start.q)[3:].min() > 0.01


@pytest.mark.parametrize(
    ('name', 'effects'),
    [
        ('leo', []),
        (
            'leo',
            [
                ('ground_slope', {'angle': 0.05}),
                ('ground_friction', {'mu': 0.5}),
                ('link_mass', 'torso', {'m': 0.3}),
                ('external_force', 'torso', {'x': 1.0}),
            ],
        ),
        (
            'leo',
            [
                ('ground_compliance', {'k': 8000.0, 'd': 100.0}),
                ('coulomb_friction', {'c': 0.1}),
                ('command_delay', {'delay': 0.01}),
                ('viscous_friction', 'left_knee', {'b': 0.1}),
            ],
        ),
        (
            'leo_ode',
            [
                ('backlash', {'gap': 0.02}),
                ('armature', {'J': 0.001}),
                ('load_dependent_friction', {'mu': 0.05}),
            ],
        ),
    ],
)
def test_pybullet_and_batched_rollouts_agree(name, effects):
    robot = ROBOTS[name]
    model = modelled(robot, *effects, scheme='training')
    volts = np.random.default_rng(0).uniform(-6, 6, (8, 6))
    angles, rates = stepped(model, volts, 0.03)
    q, dq = rollout(model, angles[:1], rates[:1], volts[None], 0.03)
    assert q[0] == pytest.approx(angles, abs=1e-8)
    assert dq[0] == pytest.approx(rates, abs=1e-6)


@pytest.mark.parametrize(
    ('effect', 'parameter', 'values'),
    [
        ('ground_friction', 'mu', [0.05, 10.0]),
        ('ground_slope', 'angle', [-0.1, 0.0]),
        ('link_mass', 'm', [0.0, 0.3]),
        ('coulomb_friction', 'c', [0.0, 0.05]),
        ('armature', 'J', [0.0, 0.002]),
    ],
)
def test_a_scan_is_the_same_as_one_by_one(effect, parameter, values):
    robot = ROBOTS['leo']
    where = 'torso' if effect == 'link_mass' else 'all'
    given = walked(Model(robot, engine='rigid', scheme='training'), 6)
    q = np.array([s.q for s, _ in given])
    dq = np.array([s.dq for s, _ in given])
    volts = np.array([u for _, u in given])[:, None]

    def run(value):
        placed = place(robot, effect, where, **{parameter: value})
        return rollout(Model(robot, [placed], scheme='training'), q, dq, volts, 0.03)[1]

    scanned = run(np.array(values)[:, None, None])
    assert scanned.shape == (2, 6, 2, 9)
    for one, value in zip(scanned, values, strict=True):
        assert one == pytest.approx(run(value), abs=1e-9)
    assert np.abs(scanned[0] - scanned[1]).max() > 1e-3


def ends(robot, effects):
    """States after each of some steps from where a robot staggers."""
    model = Model(robot, effects, engine='rigid', scheme='training')
    after = [model.step(state, volts, 0.03) for state, volts in walked(model, 8)]
    return np.array([[s.q, s.dq] for s in after])


@pytest.mark.parametrize(
    ('robot', 'effect', 'values'),
    [
        ('leo', None, {}),
        ('leo_ode', 'backlash', {'gap': 0.03}),
        ('leo', 'coulomb_friction', {'c': 0.05}),
    ],
)
def test_periods_in_one_call_are_those_one_by_one(robot, effect, values, monkeypatch):
    made = ROBOTS[robot]
    effects = [place(made, effect, 'all', **values)] if effect else []
    together = ends(made, effects)
    calls = []
    kernel = multirate.advance
    monkeypatch.setattr(multirate, 'Spatial', Single)
    monkeypatch.setattr(multirate, 'advance', lambda *a: calls.append(1) or kernel(*a))
    assert ends(made, effects) == pytest.approx(together, abs=1e-9)
    assert calls


STEADY = {
    'back_emf_scale': {'k': 1.3},
    'bias_torque': {'t': 0.2},
    'coulomb_friction': {'c': 0.1},
    'torque_scale': {'k': 0.8},
    'viscous_friction': {'b': 0.05},
}


def test_these_laws_are_asked_once_per_step():
    steady = {
        n for n, effect in EFFECTS.items() if effect.steady and effect.applies(ROBOTS['leo'])
    }
    assert steady == set(STEADY)


@pytest.mark.parametrize('name', STEADY)
def test_a_steady_law_may_as_well_be_asked_every_period(name, monkeypatch):
    placed = place(ROBOTS['leo'], name, 'all', **STEADY[name])
    once = ends(ROBOTS['leo'], [placed])
    monkeypatch.setattr(type(placed.effect), 'steady', False)
    assert ends(ROBOTS['leo'], [placed]) == pytest.approx(once, abs=1e-8)


def test_schemes_are_close_to_short_steps():
    given = walked(Model('leo', engine='rigid', scheme='training'), 15)
    q, dq = (np.array([getattr(s, part) for s, _ in given]) for part in ('q', 'dq'))
    volts = np.array([u for _, u in given])[:, None]
    exact = rollout(Model('leo', integration_step=1e-5), q, dq, volts, 0.03)
    for scheme, share in (('reference', 0.01), ('training', 0.02)):
        coarse = rollout(Model('leo', scheme=scheme), q, dq, volts, 0.03)
        for wrong, right in zip(coarse, exact, strict=True):
            error = (wrong - right)[:, 1, 2:]
            assert np.median(np.abs(error)) < share * np.std((right[:, 1] - right[:, 0])[:, 2:])


def test_any_order_and_another_process_give_the_same_bits():
    given = pairs()
    here = digest(given[:20])
    model = Model('leo', scheme='training')
    for state, volts in reversed(given):
        model.step(state, volts, 0.03)
    after = [model.step(state, volts, 0.03) for state, volts in given[:20]]
    hashed = hashlib.sha256(b''.join(s.q.tobytes() + s.dq.tobytes() for s in after))
    assert hashed.hexdigest() == here
    program = PROGRAM.format(folder=__file__.rsplit('/', 1)[0])
    other = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, check=True
    )
    assert other.stdout.strip() == here


def test_a_loaded_gear_grips_harder_on_the_ground_than_in_the_air():
    robot, slowed = ROBOTS['leo'], []
    effects = ((), (place(robot, 'load_dependent_friction', 'left_knee', mu=0.3),))
    for height in (0.0, 1.0):
        rates = []
        for placed in effects:
            model = Model(robot, placed, engine='rigid')
            start = model.start('standing')
            up = State(start.q + np.array([0, height, *np.zeros(7)]), start.dq)
            rates.append(model.step(up, [0, 0, -2.0, 0, 0, 0], 0.03).dq[5])
        slowed.append(abs(rates[1] / rates[0]))
    assert slowed[0] < 0.9 * slowed[1] < 1


def test_a_step_from_outside_the_stops_is_one_clear_line():
    model = Model('leo', engine='rigid')
    start = model.start()
    bent = State(start.q + np.array([0, 0, 0, 0, 0, 1.0, 0, 0, 0]), start.dq)
    with pytest.raises(UserError, match=r'left_knee is at 0\.9985 rad, outside its stops'):
        model.step(bent, np.zeros(6), 0.03)
