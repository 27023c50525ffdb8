# SPDX-License-Identifier: Apache-2.0
"""Every fault of the catalogue says what it is, does something, and is undone by its patch."""

from dataclasses import fields, replace

import numpy as np
import pytest
from tests.simulate import POSITION, record

from leo_diffmodel.bags.mend import mended
from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.faults.catalogue import FAULTS
from leo_diffmodel.faults.found import Found
from leo_diffmodel.faults.mending import map_of
from leo_diffmodel.outside.finding import ERROR
from leo_lab.blind.spoil import spoil

SIZES = {
    'speed_wraps': 100.0,
    'speed_sign_bit': 50.0,
    'speed_late': 0.1,
    'input_late': 0.1,
    'time_stretch': 1.5,
    'frozen': 0.5,
}
EXACT = [
    *(f'speed_{what}' for what in ('scale', 'sign', 'zero', 'wraps', 'sign_bit')),
    *(f'angle_{what}' for what in ('scale', 'sign', 'zero')),
    *('input_scale', 'input_sign', 'time_stretch'),
]


@pytest.fixture(scope='module')
def log():
    return record(POSITION, seconds=5)


def size(name) -> float:
    return -1.0 if name.endswith('sign') else SIZES.get(name, 0.5)


def spoilt(log, name) -> Episode:
    return spoil(name, log.episodes[0], 0, 0, size(name))


@pytest.mark.parametrize(
    'name', [n for n in FAULTS if n not in ('gravity_compensated', 'input_exchanged')]
)
def test_it_changes_its_channel_and_no_other(log, name):
    clean, other = log.episodes[0], spoilt(log, name)
    changed = {
        f.name
        for f in fields(Episode)
        if not np.array_equal(getattr(clean, f.name), getattr(other, f.name))
        and getattr(clean, f.name) is not None
    }
    of = {'angle': {'q'}, 'speed': {'dq'}, 'input': {'inputs'}, 'time': {'t'}}
    also = {'repeated': {'dq'}, 'goal_exchanged': {'inputs'}}.get(name, set())
    assert changed and changed <= of[FAULTS[name].channel] | also


@pytest.mark.parametrize('name', EXACT)
def test_its_patch_is_its_inverse(log, name):
    joint = '' if name == 'time_stretch' else 'pivot'
    found = Found(name, ERROR, '', joint=joint, value=size(name), evidence='kinematics')
    wrong = replace(log, input='torque', episodes=(spoilt(log, name),))
    (clean,), (back,) = log.episodes, mended(wrong, map_of([found])).episodes
    for column in ('t', 'q', 'dq', 'inputs'):
        assert getattr(back, column) == pytest.approx(getattr(clean, column), abs=1e-9), column


@pytest.mark.parametrize('name', ['speed_late', 'input_late'])
def test_a_late_channel_is_moved_back(log, name):
    mapping = TopicMap.model_validate({'joints': {'pivot': {name: 0.1}}})
    (back,) = mended(replace(log, episodes=(spoilt(log, name),)), mapping).episodes
    (clean,) = log.episodes
    column = 'dq' if name == 'speed_late' else 'inputs'
    middle = (clean.t > 0.5) & (clean.t < 4.5)
    again = np.interp(clean.t[middle] + 1e-6, back.t, getattr(back, column)[:, 0])
    assert np.corrcoef(getattr(clean, column)[middle, 0], again)[0, 1] > 0.99


@pytest.mark.parametrize('name', FAULTS)
def test_it_says_what_a_reader_must_know(name):
    fault = FAULTS[name]
    assert all([fault.law, fault.looks_like, fault.confused_with, fault.costs])
    assert fault.patch(2.0) or fault.todo
