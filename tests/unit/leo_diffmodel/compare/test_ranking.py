# SPDX-License-Identifier: Apache-2.0
"""Several models of one robot on one recording: best first, and what cannot be told apart."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulate import PENDULUM, record

from leo_diffmodel.bags.types import at_rows
from leo_diffmodel.compare.ranking import behind, rank
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

TRUTH = 1e-4


def rubbing(b: float, **more) -> Model:
    """A pendulum with viscous friction [N m s/rad]."""
    return Model(PENDULUM, [place(PENDULUM, 'viscous_friction', 'pivot', b=b)], **more)


@pytest.fixture(scope='module')
def recording():
    return record(PENDULUM, place(PENDULUM, 'viscous_friction', 'pivot', b=TRUTH), seconds=16)


@pytest.fixture(scope='module')
def ranked(recording):
    models = {
        'bare': Model(PENDULUM),
        'double': rubbing(2 * TRUTH),
        'right': rubbing(TRUTH),
        'near': rubbing(1.0003 * TRUTH),
    }
    return rank([recording], models)


def test_best_first_and_the_right_one_is_at_the_noise(ranked):
    rows = ranked['models']
    assert {rows[0]['model'], rows[1]['model']} == {'right', 'near'}
    shares = [row['share'] for row in rows]
    assert shares == sorted(shares)
    assert rows[0]['share'] < 1.3 * rows[0]['noise_share'] < 0.1 * rows[2]['share']
    assert rows[0]['rmse'] == pytest.approx(rows[0]['noise_floor'], rel=0.3)
    assert ranked['seconds'] == pytest.approx(0.5) and ranked['blocks'] == 8


def test_only_models_that_differ_beyond_their_scatter_are_told_apart(ranked):
    told = {row['model']: row['behind']['distinguishable'] for row in ranked['models'][1:]}
    assert told == {**dict.fromkeys(told, True), ranked['models'][1]['model']: False}


def test_a_model_that_was_fitted_to_the_bag_is_scored_on_what_its_fit_did_not_see(recording):
    saw = [{'added': 'viscous_friction:pivot', 'bags': [{'sha256': recording.sha256}]}]
    models = {'bare': Model(PENDULUM), 'fitted': rubbing(TRUTH, history=saw)}
    data = rank([recording], models)
    assert data['held_out_blocks_only'] and data['blocks'] == 2
    assert data['models'][0]['model'] == 'fitted'
    assert not rank([replace(recording, sha256='1' * 64)], models)['held_out_blocks_only']


def test_the_interval_is_over_blocks_and_not_over_windows():
    block = np.repeat(np.arange(4), 100)
    apart = behind(np.repeat([1.0, 1.1, 0.9, 1.0], 100), block)
    assert apart['value'] == pytest.approx(1.0) and apart['distinguishable']
    assert np.diff(apart['ci95']) == pytest.approx(2 * 3.182 * 0.0816 / 2, rel=1e-3)
    assert not behind(np.repeat([4.0, -1.0, 1.0, 0.0], 100), block)['distinguishable']
    of_one_block = behind(np.ones(9), np.zeros(9))
    assert of_one_block == {'value': 1.0, 'ci95': None, 'distinguishable': False}


def test_models_of_different_robots_are_refused(recording):
    models = {'a': Model(PENDULUM), 'b': Model(load_robot('double_pendulum'))}
    with pytest.raises(UserError, match='b is of the robot double_pendulum and a of pendulum'):
        rank([recording], models)


def test_a_recording_too_short_for_a_window_is_refused(recording):
    short = replace(recording, episodes=(at_rows(recording.episodes[0], slice(0, 5)),))
    with pytest.raises(UserError, match='record at least 2 s'):
        rank([short], {'a': Model(PENDULUM), 'b': rubbing(TRUTH)})
