# SPDX-License-Identifier: Apache-2.0
"""Transfers to the real LEO: what their lines come to, and a small one from end to end."""

from dataclasses import asdict, replace
import json
import time

import pytest

from leo_diffmodel.difference import network
from leo_lab.thesis import bags, transfer, transfer_page, walking
from leo_lab.thesis.transfer import Case
from leo_learner.ddpg.configs import RECOMMENDED_WALKING

CASES = [Case('thesis', 'network', 2, 5000, 60_000, seed) for seed in (0, 1)]


def walk(distance, fell=False):
    return {
        'return': 200 * distance,
        'distance': distance,
        'fell': fell,
        'energy_per_metre': 300 / distance,
    }


def line(case, ideal, last, reference):
    return asdict(case) | {
        'rounds': [[walk(ideal, fell=True)], [walk(last - 1)], [walk(last)]],
        'driver': 2,
        'samples': 12_000,
        'reference': [walk(reference)],
        'reference_curve': [[1000, -5.0], [40_000, 200 * last - 1], [50_000, 200 * last + 1]],
        'errors': {
            'mse_before_1': 0.06,
            'mse_after_1': 0.02,
            'mse_before_10': None,
            'mse_after_10': None,
        },
        'paths': [[[0.0, 0.3], [0.1, 0.2]], [[0.0, 0.3], [0.4, 0.31]]],
        'left': [
            {'seconds': 0.6, 'channel': 'left_knee torque', 'share': 0.2},
            {'seconds': None, 'channel': None, 'share': 0.0},
        ],
    }


ROWS = [line(CASES[0], 2.0, 12.0, 12.5), line(CASES[1], 4.0, 13.0, 12.5)]


def test_share_and_robot_time_by_hand():
    share, low, high = transfer_page.share(ROWS)
    assert (share, low, high) == pytest.approx((1.0, 12 / 12.5, 13 / 12.5))
    assert transfer_page.from_scratch(ROWS[0]) == pytest.approx(0.03 * 50_000)
    assert transfer_page.from_scratch(ROWS[0] | {'reference_curve': [[1000, -5.0]]}) is None


def test_table_and_figure(tmp_path):
    text = transfer_page.table(CASES, ROWS)
    for cell in (
        '3.00 ± 12.71',
        '12.50 ± 6.35',
        '1.000 (0.960 to 1.040)',
        '2 of 2',
        '0 of 2',
        '360',
        '0.06 -> 0.02',
        '0.60 s left_knee torque / never',
        '1500, 1500',
    ):
        assert cell in text
    transfer_page.figure('title', CASES, ROWS, tmp_path / 'figure.png')
    assert (tmp_path / 'figure.png').stat().st_size > 10_000


@pytest.mark.parametrize('repair', ['network', 'full'])
def test_a_transfer_from_end_to_end(tmp_path, monkeypatch, repair):
    small = replace(RECOMMENDED_WALKING, hidden=(8, 8), warm_up=40, test_steps=60)
    monkeypatch.setitem(walking.CONFIGS, 'recommended', small)
    monkeypatch.setattr(transfer, 'RECOMMENDED_WALKING', small)
    monkeypatch.setattr(transfer, 'FIRST_STEPS', 80)
    monkeypatch.setattr(transfer, 'TEST_STEPS', 40)
    monkeypatch.setattr(walking, 'STARTS', 1)
    for name in ('torque', 'full'):
        config = replace(network.CONFIGS[name], hidden=(8,), members=2, epochs=2)
        monkeypatch.setitem(bags.CONFIGS, name, config)
    case = Case('thesis', repair, 1, 120, 80, 0)
    began = time.monotonic()
    row = json.loads(json.dumps(transfer.run_case(case, tmp_path)))
    took = time.monotonic() - began
    assert asdict(case).items() <= row.items()
    assert len(row['rounds']) == 2 and len(row['fits']) == 1 and row['samples'] > 120
    assert row['errors']['mse_before_1'] > 0 and len(row['paths'][1]) > 2
    assert (transfer.share(case, tmp_path), row['driver'] in (0, 1)) == (0.5, True)
    assert transfer_page.table([case], [row]).count('\n') == 2
    trained = [
        walking.spent(tmp_path / transfer.ideal_case(0, truth).folder)
        for truth in ('ideal', 'real')
    ]
    assert min(trained) > 0
    assert 0 < row['seconds'] < took - sum(trained) + 0.1
    algorithm = json.loads((tmp_path / case.folder / transfer.DONE).read_text())
    assert transfer.run_case(case, tmp_path)['seconds'] >= algorithm['seconds'] > 0
