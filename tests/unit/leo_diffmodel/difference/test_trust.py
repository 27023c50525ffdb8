# SPDX-License-Identifier: Apache-2.0
"""Ensembles and forms of the difference model: calibration, fading, torques, files."""

from dataclasses import replace
import json

import numpy as np
import pytest
from safetensors.torch import save
from tests.difference import untrained
import torch

from leo_diffmodel.difference.data import channel_names, predicted, Transitions
from leo_diffmodel.difference.fit import calibration, fit, TRAIN
from leo_diffmodel.difference.model import from_bytes
from leo_diffmodel.difference.network import CONFIGS, RECOMMENDED, THESIS
from leo_diffmodel.difference.service import correction
from leo_diffmodel.difference.tensors import read_tensors
from leo_diffmodel.difference.training import targets
from leo_diffmodel.difference.trust import calibrated
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.batch import rollout

FRICTION = 2e-4  # N m s/rad: some 0.4 of the pendulum's back-EMF.
FORMS = ('recommended', 'torque', 'full')


@pytest.fixture(scope='module')
def model() -> Model:
    return Model('pendulum')


@pytest.fixture(scope='module')
def steps(model) -> Transitions:
    """Single steps from states all over, of a pendulum that hides viscous friction."""
    rng, count = np.random.default_rng(0), 1200
    q, dq = rng.uniform(-np.pi, np.pi, (count, 1)), rng.normal(0, 6, (count, 1))
    u = rng.uniform(-3, 3, (count, 1))
    real = model.changed(effects=[place(model.robot, 'viscous_friction', 'pivot', b=FRICTION)])
    after = [x[:, 1] for x in rollout(real, q, dq, u[:, None], 0.05)]
    return predicted(Transitions(q, dq, u, *after, *after, 0.05), model)


@pytest.fixture(scope='module')
def fitted(model, steps):
    small = {name: replace(CONFIGS[name], hidden=(32, 32), epochs=60) for name in FORMS}
    return {name: fit(steps, model, config) for name, config in small.items()}


def test_calibration_makes_held_out_errors_of_unit_size():
    rng, wrong = np.random.default_rng(1), np.array([0.5, 3.0, 10.0])
    spread = rng.uniform(0.5, 2.0, (4000, 3)) * np.array([1e-3, 1.0, 20.0])
    error = wrong * spread * rng.normal(size=spread.shape)
    trust = calibrated(error[:2000], spread[:2000], np.ones(3), np.zeros(3))
    np.testing.assert_allclose(trust.temperature, wrong, rtol=0.1)
    unit = error[2000:] / trust.uncertainty(spread[2000:])
    np.testing.assert_allclose(unit.std(axis=0), 1.0, rtol=0.1)
    factor = trust.factor(trust.strain(spread[2000:]))
    assert np.mean(factor == 1.0) > 0.97


def test_the_factor_falls_smoothly_from_one_to_nothing():
    rng = np.random.default_rng(2)
    error, spread = rng.normal(size=(500, 2)), rng.uniform(1, 2, (500, 2))
    trust = calibrated(error, spread, np.ones(2), np.zeros(2))
    strain = trust.limit * np.stack([np.linspace(0, 3, 301), np.zeros(301)], axis=-1)
    factor = trust.factor(strain)
    assert factor[100] == 1.0 and factor[150] == pytest.approx(0.5) and factor[200] == 0.0
    assert np.all(np.diff(factor) <= 0) and np.abs(np.diff(factor, 2)).max() < 1e-3


def test_a_trifle_beside_the_usual_correction_is_no_reason_to_leave_it_out():
    error = 1e-4 * np.random.default_rng(3).normal(size=(500, 2))
    trust = calibrated(error, np.abs(error), np.ones(2), np.array([1.0, 1e-9]))
    known, unknown = trust.uncertainty(np.array([[0.09, 0.0], [0.0, 0.09]]))
    np.testing.assert_allclose(trust.temperature, 1.0)
    assert trust.factor(trust.strain(known)) == 1.0
    assert trust.factor(trust.strain(unknown)) == 0.0
    assert trust.factor(trust.strain(3 * known)) == 0.0


@pytest.mark.parametrize('form', ['recommended', 'torque'])
def test_both_forms_take_the_hidden_friction_away(fitted, form):
    report = fitted[form][1]
    assert report.mse_after < 0.05 * report.mse_before
    assert report.inside > 0.9
    assert 0.5 < report.calibration_least <= report.calibration_most < 2.0


def test_held_out_calibration_is_what_the_report_says(model, steps, fitted):
    difference, report = fitted['recommended']
    data = targets(steps, model, 'state').part(slice(round(TRAIN * len(steps)), None))
    assert calibration(difference, data).max() == pytest.approx(report.calibration_most)


def test_the_torque_form_finds_the_torque(fitted):
    dq = np.linspace(-6, 6, 7)[:, None]  # hanging: little gravity changes it within the step
    torque = fitted['torque'][0](np.full_like(dq, np.pi), dq, np.zeros_like(dq))
    np.testing.assert_allclose(torque, -FRICTION * dq, atol=0.25 * FRICTION * 6)


@pytest.mark.parametrize('form', ['recommended', 'torque'])
def test_far_from_the_data_nothing_is_corrected(fitted, steps, form):
    difference = fitted[form][0]
    near = difference.judge(steps.q, steps.dq, steps.inputs)
    assert np.median(near.factor) == 1.0
    far = difference.judge(steps.q, steps.dq + 100.0, steps.inputs)
    assert np.mean(far.factor < 0.01) > 0.99
    assert np.abs(far.correction).max() <= np.abs(near.correction).max() * (1 + 1e-6)
    assert np.median(difference.judge(steps.q, steps.dq, steps.inputs * 50.0).factor) == 0.0


@pytest.mark.parametrize('form', FORMS)
def test_one_step_and_many_are_the_same(fitted, model, steps, form):
    difference, few = fitted[form][0], steps.part(slice(0, 5))
    q, dq = difference.predict(few, model)
    for k in range(5):
        before = model.state_from(few.q[k], few.dq[k])
        wanted = difference(few.q[k], few.dq[k], few.inputs[k])
        after = difference.applied(model, before, few.inputs[k], wanted)
        assert np.cos(after.q) == pytest.approx(np.cos(q[k]), abs=1e-6)
        assert after.dq == pytest.approx(dq[k], abs=1e-5)


def test_a_corrected_joint_stays_within_its_stops():
    leo = Model('leo', scheme='training')
    network = untrained(leo)
    wanted = np.zeros(19)
    wanted[2 + 5] = 5.0  # rad, the right knee's: 2 numbers for the torso, x, z, four joints
    after = network.applied(leo, leo.start('hanging'), np.zeros(6), wanted)
    assert after.q[6] == pytest.approx(leo.laws.stops[1][6])
    leo.step(after, np.zeros(6), 0.03)


def test_channels_are_named():
    names = channel_names(load_robot('pendulum'), 'state')
    assert names == ('pivot angle', 'pivot angle', 'pivot rate')
    leo = load_robot('leo')
    assert channel_names(leo, 'torque')[2] == 'left_knee torque'
    assert len(channel_names(leo, 'state')) == untrained(Model(leo)).layout.states


@pytest.mark.parametrize('form', FORMS)
def test_files_come_back_as_they_were(fitted, steps, form):
    difference = fitted[form][0]
    data = difference.to_bytes()
    again = from_bytes(data)
    rows = steps.q, steps.dq, steps.inputs
    for one, two in zip(difference.judge(*rows), again.judge(*rows), strict=True):
        np.testing.assert_array_equal(one, two)
    assert read_tensors(data)[1]['form'] == again.config.form


def test_files_of_before_there_were_forms_are_read(model, steps):
    single, report = fit(steps, model, replace(THESIS, hidden=(8,), epochs=1))
    assert report.inside is None
    tensors, old = read_tensors(single.to_bytes())
    del old['form']
    config = json.loads(old['config'])
    newer = 'form', 'members', 'prior'
    old['config'] = json.dumps({k: config[k] for k in config if k not in newer})
    judged = from_bytes(save(tensors, old)).judge(steps.q, steps.dq, steps.inputs)
    np.testing.assert_array_equal(judged.correction, single(steps.q, steps.dq, steps.inputs))
    assert judged.channel is None and np.all(judged.factor == 1.0)


def respelled(data: bytes, name: str, value: np.ndarray | str | None) -> bytes:
    """Weights with another tensor or another text in the metadata, or without that text."""
    tensors, told = read_tensors(data)
    if isinstance(value, np.ndarray):
        return save(tensors | {name: torch.from_numpy(value)}, told)
    del told[name]
    return save(tensors, told | ({} if value is None else {name: value}))


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('input_mean', np.full(4, np.nan, np.float32)),
        ('trust.bound', np.array([1.0, np.inf, 1.0])),
        ('trust.limit', np.ones(2)),
        ('trust.limit', np.zeros(3)),
        ('trust.error', -np.ones(3)),
        ('version', 'abc'),
        ('trained_on', None),
        ('robot', None),
        ('layout', '[]'),
        ('over', '[1]'),
    ],
)
def test_damaged_weights_are_one_line(fitted, name, value):
    with pytest.raises(UserError, match=r'^topic: not the weights') as error:
        from_bytes(respelled(fitted['recommended'][0].to_bytes(), name, value), 'topic')
    assert '\n' not in str(error.value)


@pytest.mark.parametrize('form', FORMS)
def test_nothing_is_added_to_what_is_not_finite_or_too_large(fitted, form):
    q, dq, u = np.ones((3, 4, 1))
    q[1], dq[2], u[3] = np.nan, 1e300, np.inf
    judged = fitted[form][0].judge(q, dq, u)
    assert np.array_equal(judged.factor[1:], np.zeros(3)) and judged.factor[0] > 0.0
    assert not judged.correction[1:].any() and judged.correction[0].any()


def test_a_query_that_leads_nowhere_is_answered_with_nothing(fitted, model):
    state = np.array([1e300])
    with np.errstate(all='raise'):
        for inputs in (state, np.array([np.nan])):
            answer = correction(model, model, fitted['recommended'][0], state, state, inputs)
            assert not np.any(answer)


def test_it_goes_with_the_model_it_was_fitted_over_alone(fitted, model):
    difference = from_bytes(fitted['recommended'][0].to_bytes(), 'weights')
    assert difference.beneath(model) is model
    drag = place(model.robot, 'viscous_friction', 'pivot', b=FRICTION)
    for other, said in (
        (model.changed(effects=[drag]), r'another list of effects \(none, here viscous'),
        (model.changed(constants={'links.bob.mass': 0.12}), r'another links\.bob\.mass'),
        (Model('servo_pendulum'), 'another robot'),
        (Model(replace(model.robot, control_period=0.01)), 'another control period'),
    ):
        with pytest.raises(UserError, match=f'^weights .*{said}.* fit it anew'):
            difference.beneath(other)


def test_bad_files_and_too_little_data_are_one_line(model, steps, fitted):
    data = fitted['recommended'][0].to_bytes()
    tensors, told = read_tensors(data)
    blind = {name: value for name, value in tensors.items() if not name.startswith('trust.')}
    strange = told | {'config': told['config'].replace('"state"', '"dream"')}
    other = b'', b'x' * 100, save({'a': torch.zeros(1)})
    for made in (save(blind, told), save(tensors, strange), data[:-100], *other):
        with pytest.raises(UserError, match='not the weights') as error:
            from_bytes(made)
        assert '\n' not in str(error.value)
    with pytest.raises(UserError, match='39 control steps are too few'):
        fit(steps.part(slice(0, 39)), model, RECOMMENDED)
    with pytest.raises(ValueError, match='stop_on'):
        replace(RECOMMENDED, stop_on=0.0)
