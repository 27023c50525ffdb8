# SPDX-License-Identifier: Apache-2.0
"""How old a command is, and whether two send in turns, by what the middleware says of messages."""

import pytest

from leo_sim.nodes.commander import Ages, Turns, WINDOW

NOW = 1_795_000_000_000_000_000
MS = 1_000_000


@pytest.mark.parametrize(
    ('age_ms', 'stale'), [(0, False), (199, False), (201, True), (5000, True)]
)
def test_a_command_older_than_the_limit_is_stale(age_ms, stale):
    ages = Ages(0.2)
    age = ages.too_old(NOW - age_ms * MS, NOW)
    assert (age > 0.0, ages.stale) == (stale, int(stale))
    assert not stale or age == pytest.approx(age_ms / 1000)


def test_a_sender_whose_clock_is_ahead_is_judged_by_its_youngest_command():
    ages = Ages(0.2)
    ahead = 3600 * 1000 * MS
    assert ages.too_old(NOW + ahead, NOW) == 0.0
    assert ages.too_old(NOW + ahead, NOW + 100 * MS) == 0.0
    assert ages.too_old(NOW + ahead, NOW + 300 * MS) == pytest.approx(0.3)


def test_no_limit_and_no_time_of_sending_mean_nothing_is_stale():
    assert Ages(0.0).too_old(NOW - 10**12, NOW) == 0.0
    assert Ages(0.2).too_old(0, NOW) == 0.0


def heard(turns, numbers, every=0.01):
    return [turns.taken(number, k * every) for k, number in enumerate(numbers)]


def test_one_sender_never_takes_turns_even_where_messages_are_lost():
    assert not any(heard(Turns(), [1, 2, 3, 10, 11, 50]))


@pytest.mark.parametrize('rival', [1, 3, 500])
def test_two_senders_in_turns_are_noticed_within_three_messages_of_each(rival):
    numbers = [n for k in range(3) for n in (10 + k, rival + k)]
    assert any(heard(Turns(), numbers))


def test_one_after_another_is_no_turn():
    assert not any(heard(Turns(), [100, 101, 102, 1, 2, 3, 4]))
    assert not any(heard(Turns(), [5, 1, 2, 1, 2], every=WINDOW)), 'slowly one after another'


def test_a_middleware_without_numbers_tells_nothing():
    assert not any(heard(Turns(), [None, None, None, None]))
