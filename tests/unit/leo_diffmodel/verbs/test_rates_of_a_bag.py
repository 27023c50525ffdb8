# SPDX-License-Identifier: Apache-2.0
"""Logs of several rates in one bag, as verbs and Python read them."""

from argparse import Namespace

import numpy as np

from leo_diffmodel.api import _read
from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.verbs import check, common
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

MODEL = Model(load_robot('torque_pendulum'))


def log(rate: float) -> Run:
    t = np.arange(0, 4, 1 / rate)
    torque = {'pivot': {'effort': np.sin(9 * t)}}
    return Run(t, ['pivot'], np.sin(t)[:, None], np.cos(t)[:, None], inputs=torque)


def test_logs_of_several_rates_in_one_bag_are_read_apart(tmp_path):
    bag = str(write_runs(tmp_path / 'bag', [log(100.0), log(250.0)], {}))
    said = Namespace(bags=[bag], hold_out=[], topic_map=None, begin=None, end=None)
    names = ['bag (part 1, 100 Hz)', 'bag (part 2, 250 Hz)']
    assert [r.name for r in common.read_all(said, MODEL)[0]] == names
    assert [r.name for r in common.read_all(said, MODEL, whole=True)[0]] == ['bag']
    assert [r.name for r in common.read_bags([bag], MODEL, None)] == names
    assert [r.name for r in _read(bag, MODEL)] == names
    both = check._bags(said, MODEL)
    assert [(b.recording.name, b.other.name) for b in both] == [(n, n) for n in names]
