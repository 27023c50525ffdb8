# SPDX-License-Identifier: Apache-2.0
"""Public recordings of real rigs: noise, the usual friction model and a better one, held out."""

import json

from benchmarks.rig import refitted, window_errors
import numpy as np
import pytest
from tests.places import REAL_DATA

from leo_diffmodel.bags.importing.convert import import_logs
from leo_diffmodel.bags.recording import read_bag, Recording
from leo_diffmodel.compare import noise
from leo_sim.model.model_file import load_model

SERVO = REAL_DATA / 'bam_xl330'
STEP = 2 * np.pi / 4096
pytestmark = pytest.mark.skipif(
    not SERVO.exists(),
    reason=f'no real recordings in {REAL_DATA}; they are not part of this project',
)


@pytest.fixture(scope='module')
def servo(tmp_path_factory) -> dict[int, list[Recording]]:
    """The servo's runs by firmware gain, in the order of their names."""
    folder, runs = tmp_path_factory.mktemp('servo'), {}
    for log in sorted(SERVO.glob('*.json')):
        bag = import_logs([log], 'bam_xl330', folder / log.stem)
        run = read_bag(bag, load_model('servo_pendulum').robot)
        runs.setdefault(json.loads(log.read_text())['kp'], []).append(run)
    return runs


def test_a_late_rate_is_noisy_and_an_encoder_is_as_fine_as_its_steps(servo):
    model = load_model('servo_pendulum')
    for run in servo[400]:
        ((angle, rate),) = noise.estimate(model, noise.short_windows([run]))
        (e,) = run.episodes
        late = np.abs(e.dq - np.gradient(e.q, e.t, axis=0)).std()
        assert STEP / np.sqrt(12) * 0.999 < angle < STEP
        assert rate > 0.02 * late


def test_the_motor_is_free_while_torque_is_off(servo):
    drop = servo[400][1].episodes[0]
    assert 0.6 < (~drop.enabled).mean() < 0.9
    assert np.abs(drop.inputs[drop.enabled]).max() > 5
    assert all(run.episodes[0].enabled.all() for run in servo[400][:1])


def test_friction_under_load_thirds_the_error_of_the_usual_model(servo):
    given = load_model('servo_pendulum')
    runs, unseen = [*servo[100], *servo[800]], servo[400]
    usual, better, best = (
        refitted(given, [f'{n}:pivot' for n in names], runs, unseen)
        for names in (
            ('viscous_friction', 'coulomb_friction'),
            ('viscous_friction', 'load_dependent_friction'),
            ('viscous_friction', 'quadratic_load_friction'),
        )
    )
    before, after, least = (
        float(np.sqrt((window_errors(m, unseen, 0.5) ** 2).mean())) for m in (usual, better, best)
    )
    assert least < 0.4 * before and least < 0.8 * after < 0.6 * before < 0.12
