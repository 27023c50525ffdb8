# SPDX-License-Identifier: Apache-2.0
"""Logs of several rates in a bag are as many recordings; a bag of one rate stays what it is."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulate import record, TORQUE

from leo_diffmodel.bags.episode import between, by_rate, distinct
from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.compare.windows import every
from leo_msgs_py.errors import UserError

WHOLE = record(TORQUE, seconds=8.0)
FAST = WHOLE.episodes[0]
RNG = np.random.default_rng(0)


def bag(*episodes: Episode) -> Recording:
    apart = (replace(e, t=e.t + 20.0 * k) for k, e in enumerate(episodes))
    return replace(WHOLE, episodes=tuple(apart), warnings=(f'{WHOLE.path}: told',))


def slow(stride: int = 2, seconds: float = 8.0) -> Episode:
    return every(record(TORQUE, seconds=seconds), [stride]).episodes[0]


def test_each_rate_is_a_recording_with_its_own_period():
    given = bag(FAST, slow(), FAST, slow(3), slow(2, 1.0))
    parts = by_rate([given])
    names = ['(part 1, 100 Hz)', '(part 2, 50 Hz)', '(part 3, 33.33 Hz)']
    assert [p.name for p in parts] == [f'simulated_1 {name}' for name in names]
    assert [[e.t[0] for e in p.episodes] for p in parts] == [[0.0, 40.0], [20.0, 80.0], [60.0]]
    assert [p.command_period for p in parts] == pytest.approx([0.01, 0.02, 0.03])
    assert [p.warnings for p in parts] == [(f'{parts[0].path}: told',), (), ()]
    distinct(parts)
    with pytest.raises(UserError, match='is the same bag'):
        distinct([*parts, given])


def test_parts_keep_the_period_of_rare_commands_and_have_no_gaps_of_the_bag():
    told = f'{WHOLE.path}: 2 gaps; split there'
    parts = by_rate([replace(bag(FAST, slow()), command_period=0.04, warnings=(told,))])
    assert [(p.command_period, p.warnings) for p in parts] == [(0.04, ())] * 2


def test_two_cuts_of_a_bag_are_distinct_where_they_share_no_time():
    distinct([between(WHOLE, None, 4.0), between(WHOLE, 4.5, None)])
    for overlapping in (WHOLE, between(WHOLE, 3.0, None)):
        with pytest.raises(UserError, match='is the same bag'):
            distinct([between(WHOLE, None, 4.0), overlapping])


def test_a_rate_that_only_wanders_stays_one():
    def jittered(episode: Episode) -> Episode:
        steps = RNG.choice([0.01, 0.02], len(episode.t) - 1)
        return replace(episode, t=np.cumsum(np.r_[0.0, steps]))

    for given in (bag(FAST, FAST), bag(jittered(FAST), FAST), bag(FAST, slow(2, 1.0))):
        assert by_rate([given]) == [given]
