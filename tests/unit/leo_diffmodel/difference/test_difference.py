# SPDX-License-Identifier: Apache-2.0
"""Difference model: state vector, transitions from recordings, fits, weights, update jobs."""

from dataclasses import replace
from pathlib import Path
import time
from types import SimpleNamespace

import numpy as np
import pytest
from tests.damage import room_for

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.difference import job
from leo_diffmodel.difference.data import Layout, predicted, Transitions, transitions
from leo_diffmodel.difference.fit import fit, one_step_mse
from leo_diffmodel.difference.job import Updates
from leo_diffmodel.difference.model import from_bytes
from leo_diffmodel.difference.network import RECOMMENDED, THESIS, TORQUE
from leo_diffmodel.difference.service import correction
from leo_diffmodel.explain import explanation
from leo_msgs_py.errors import UserError
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.batch import rollout
from leo_sim.model.model_file import load_model

FEW = 4096  # room for a log, not for weights [bytes]
PENDULUM = Layout((True,), planar=False, actuators=1)


@pytest.fixture(scope='module')
def model() -> Model:
    return Model('pendulum')


@pytest.fixture(scope='module')
def real(model) -> Model:
    """The thesis' real pendulum: 0.09 kg, inertia about the pivot kept."""
    mass = place(model.robot, 'link_mass', 'bob', m=0.035)
    return model.changed(effects=(mass, place(model.robot, 'link_inertia', 'bob', I=-6.17e-5)))


def driven(model: Model, episodes: int, steps: int, seed: int = 0):
    """States (episodes, steps + 1, 1) and volts of a model driven by noisy bang-bang."""
    rng = np.random.default_rng(seed)
    q, dq = rng.uniform(-np.pi, np.pi, (episodes, 1)), rng.uniform(-1, 1, (episodes, 1))
    states, inputs = [(q, dq)], []
    for _ in range(steps):
        u = np.clip(2.0 * np.sign(dq) + rng.normal(0, 1, dq.shape), -3, 3)
        after = rollout(model, q, dq, u[:, None, :], 0.05)
        q, dq = after[0][:, 1], after[1][:, 1]
        states.append((q, dq))
        inputs.append(u)
    q, dq = (np.stack(column, axis=1) for column in zip(*states, strict=True))
    return q, dq, np.stack(inputs, axis=1)


@pytest.fixture(scope='module')
def steps(model, real) -> Transitions:
    q, dq, u = driven(real, 10, 250)
    flat = [part.reshape(-1, 1) for part in (q[:, :-1], dq[:, :-1], u, q[:, 1:], dq[:, 1:])]
    return predicted(Transitions(*flat, flat[3], flat[4], 0.05), model)


def recording(t, q, dq, inputs, enabled=None) -> Recording:
    on = np.ones(inputs.shape, bool) if enabled is None else enabled
    episode = Episode(t=t, q=q, dq=dq, inputs=inputs, enabled=on)
    return Recording(Path('a.bag'), '', ('pivot',), ('pivot',), 'voltage', 0.05, (episode,), {})


def test_state_vector_of_the_pendulum_and_of_legs():
    state = PENDULUM.state(np.array([0.3]), np.array([2.0]))
    np.testing.assert_allclose(state, [np.cos(0.3), np.sin(0.3), 2.0])
    leo = Layout((False,) * 9, planar=True, actuators=6)
    assert leo.states == 18
    near, far = np.arange(9.0), np.arange(9.0) + np.eye(9)[0] * 100
    seen = [leo.network_input(q, near, np.zeros(6)) for q in (near, far)]
    assert np.array_equal(*seen)


def test_moving_by_the_difference_hits_the_state_and_keeps_turns():
    layout = Layout((True, False), planar=False, actuators=2)
    q, dq = np.array([[7.0, 1.0]]), np.array([[0.5, -2.0]])
    wanted_q, wanted_dq = np.array([[6.6, 1.3]]), np.array([[1.0, 3.0]])
    difference = layout.state(wanted_q, wanted_dq) - layout.state(q, dq)
    np.testing.assert_allclose(layout.moved(q, dq, difference), (wanted_q, wanted_dq))


def test_transitions_of_a_faster_log_are_control_steps(model, real):
    q, dq, u = driven(real, 1, 20)
    times = np.arange(101) * 0.01
    inputs = np.repeat(u[0], 5, axis=0)
    inputs = np.vstack([inputs, inputs[-1:]])
    fast_q, fast_dq = (np.full((101, 1), np.nan) for _ in range(2))
    fast_q[::5], fast_dq[::5] = q[0], dq[0]
    found = transitions([recording(times, fast_q, fast_dq, inputs)], model)
    assert len(found) == 20
    np.testing.assert_array_equal(found.inputs, u[0])
    np.testing.assert_array_equal(found.q_next, q[0, 1:])
    after = model.step(model.state_from(q[0, 3], dq[0, 3]), u[0, 3], 0.05)
    np.testing.assert_allclose(found.dq_model[3], after.dq, atol=1e-6)


def test_steps_with_motors_off_or_late_are_left_out(model):
    t = np.array([0.0, 0.05, 0.10, 0.15, 0.25, 0.30])
    q = np.zeros((6, 1))
    enabled = np.ones((6, 1), bool)
    enabled[1] = False
    found = transitions([recording(t, q, q, np.arange(6.0)[:, None], enabled)], model)
    assert found.inputs.ravel().tolist() == [0.0, 2.0, 4.0]
    with pytest.raises(UserError, match='no control step'):
        transitions([recording(t, q, q, q, np.zeros((6, 1), bool))], model)


def test_steps_of_several_lengths_are_refused_and_a_passive_bag_is_none(model):
    t, q = np.arange(9) * 0.05, np.zeros((9, 1))
    usual = recording(t, q, q, q)
    twice = replace(recording(2 * t, q, q, q), command_period=0.1)
    with pytest.raises(UserError, match=r'100 ms, in a\.bag every 50 ms'):
        transitions([usual, twice], model)
    many = recording(np.arange(50) * 0.1, *[np.zeros((50, 1))] * 3)
    slow = transitions([replace(many, command_period=0.1)], model)
    with pytest.raises(UserError, match=r'every 100 ms, the control period of pendulum is 50 ms'):
        fit(slow, model, RECOMMENDED)
    passive = replace(recording(2 * t, q, q, q, np.zeros((9, 1), bool)), command_period=0.1)
    assert len(transitions([passive, usual], model)) == 8


def test_recommended_network_takes_the_gap_away(steps, model, real):
    fitted, report = fit(steps, model, RECOMMENDED)
    assert report.mse_after < 0.02 * report.mse_before  # with the steps beyond the data's edge
    held_out = steps.part(slice(1875, None))
    within = fitted.judge(held_out.q, held_out.dq, held_out.inputs).factor == 1.0
    before, after = one_step_mse(held_out.part(within), fitted, model)
    assert within.mean() > 0.9 and after < 0.005 * before
    again = from_bytes(fitted.to_bytes())
    assert (again.version, again.trained_on, again.robot) == (1, 2500, 'pendulum')
    assert one_step_mse(steps, again, model) == one_step_mse(steps, fitted, model)
    state, u = real.state_from([2.0], [3.0]), [1.0]
    added = correction(model, model, fitted, state.q, state.dq, np.array(u))
    wanted = real.step(state, u, 0.05).dq - model.step(state, u, 0.05).dq
    assert added[1] == pytest.approx(wanted, abs=0.2 * abs(float(wanted[0])))


def test_later_fit_starts_from_the_former(steps, model):
    short = replace(RECOMMENDED, epochs=30)
    first, _ = fit(steps, model, short)
    second, report = fit(steps, model, replace(short), start=first)
    assert second.version == 2
    np.testing.assert_array_equal(second.network.input_mean, first.network.input_mean)
    assert report.mse_after < 2 * one_step_mse(steps.part(slice(1875, None)), first, model)[1]


def test_thesis_network_is_the_thesis(steps, model):
    fitted, _ = fit(steps.part(slice(0, 200)), model, replace(THESIS, epochs=2))
    shapes = [tuple(p.shape) for p in fitted.network.parameters() if p.ndim == 2]
    assert shapes == [(400, 4), (400, 400), (400, 400), (3, 400)]
    assert (THESIS.dropout, THESIS.rate, THESIS.batch, THESIS.epochs) == (0.3, 0.02, 32, 300)
    assert not fitted.network.input_mean.any()


def test_same_seed_same_weights(steps, model):
    few, short = steps.part(slice(0, 300)), replace(RECOMMENDED, epochs=3)
    one, two = (fit(few, model, short, seed=5)[0] for _ in range(2))
    rows = few.q, few.dq, few.inputs
    assert np.array_equal(one(*rows), two(*rows))


def recorded(real: Model, folder: Path) -> Path:
    u = np.random.default_rng(0).uniform(-3, 3, (1, 120, 1))
    q, dq = rollout(real, np.ones((1, 1)), np.zeros((1, 1)), u, 0.05)
    volts = {'pivot': {'voltage': np.append(u[0, :, 0], 0.0)}}
    run = Run(np.arange(121) * 0.05, ['pivot'], q[0], dq[0], inputs=volts)
    write_runs(folder, [run], {'robot': 'pendulum'})
    return folder


def ended(updates: Updates) -> str:
    until = time.monotonic() + 300
    while not updates.poll():
        assert updates.busy and time.monotonic() < until
        time.sleep(0.05)
    return updates.progress.state


def test_a_fit_that_cannot_write_is_one_line(tmp_path):
    (tmp_path / 'file').touch()
    updates = Updates(tmp_path / 'file' / 'weights', 'pendulum', 'recommended')
    with pytest.raises(UserError, match='cannot begin a fit in'):
        updates.begin([tmp_path])
    assert not updates.busy


def test_job_with_a_broken_bag_fails_with_its_reason(tmp_path):
    bag = tmp_path / 'rollout'
    bag.mkdir()
    (bag / 'rollout_0.mcap').write_bytes(b'no mcap')
    updates = Updates(tmp_path / 'weights', 'pendulum', 'recommended')
    with pytest.raises(UserError, match='nothing is recorded'):
        updates.begin([])
    updates.begin([bag])
    assert ended(updates) == 'failed' and str(bag) in updates.progress.error
    assert not updates.kept() and not updates.busy


def test_a_full_disk_fails_an_update_and_a_later_one_goes_well(model, real, steps, tmp_path):
    bag, weights = recorded(real, tmp_path / 'rollout'), tmp_path / 'weights'
    updates, names = Updates(weights, 'pendulum', 'torque'), ['difference-001.safetensors']
    former, _ = fit(steps.part(slice(0, 200)), model, replace(TORQUE, epochs=1))
    weights.mkdir()
    (weights / names[0]).write_bytes(former.to_bytes())
    with room_for(FEW):
        updates.begin([bag])
    assert ended(updates) == 'failed'
    assert 'File too large' in updates.progress.error and str(weights) in updates.progress.error
    assert [file.name for file in weights.iterdir()] == names
    updates.begin([bag])
    assert ended(updates) == 'fitted'
    assert updates.kept()[2] == weights / 'difference-002.safetensors'


def test_damaged_weights_are_said_and_passed_over(model, real, steps, tmp_path, capfd):
    bag, weights = recorded(real, tmp_path / 'rollout'), tmp_path / 'weights'
    updates = Updates(weights, 'pendulum', 'torque')
    former, _ = fit(steps.part(slice(0, 200)), model, replace(TORQUE, epochs=1))
    weights.mkdir()
    for number, size in ((998, None), (999, 100), (1000, 0)):
        file = weights / f'difference-{number}.safetensors'
        file.write_bytes(former.to_bytes()[:size])
    (weights / 'difference-old.safetensors').touch()
    updates.begin([bag])
    assert ended(updates) == 'fitted'
    assert list(updates.kept()) == [1001, 1000, 999, 998]
    assert from_bytes(updates.kept()[1001].read_bytes()).version == 1001
    said = capfd.readouterr().err.splitlines()
    for line, name in zip(said, ('1000', '999'), strict=True):
        assert f'difference-{name}.safetensors: not the weights' in line
        assert line.endswith('; passed over')


def test_a_fit_that_makes_it_worse_is_not_kept(model, tmp_path):
    updates = Updates(tmp_path / 'weights', 'pendulum', 'torque')
    updates.begin([recorded(model, tmp_path / 'bag')])
    assert ended(updates) == 'failed' and job.NOT_BETTER in updates.progress.error
    assert not updates.kept()


def test_a_repair_that_was_not_kept_gives_way_to_the_next(model, real, monkeypatch, tmp_path):
    monkeypatch.setattr(explanation, 'explain', lambda *_: SimpleNamespace(model=found.pop()))
    found, path = [real, model], tmp_path / 'difference-001.yaml'
    assert job.repaired([], model, path)[0] is model
    assert job.repaired([], model, path)[0] is real
    assert len(load_model(path).effects) == 2
