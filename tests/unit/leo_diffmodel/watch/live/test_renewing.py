# SPDX-License-Identifier: Apache-2.0
"""The state of the page, renewed with what a robot has measured meanwhile."""

import time

import pytest
from tests.patience import PATIENCE
from tests.simulate import bag, record, TORQUE

from leo_diffmodel.bags.contents import BagContents, load
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.watch.live.renewing import Renewing, Source
from leo_diffmodel.watch.state import State
from leo_sim.effects import place
from leo_sim.model import Model

FRICTION = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2)


@pytest.fixture(scope='module')
def contents(tmp_path_factory):
    folder = tmp_path_factory.mktemp('live')
    return [
        load(bag(folder / f'{seed}', record(TORQUE, FRICTION, seconds=12, seed=seed)))
        for seed in (1, 2)
    ]


@pytest.fixture
def source():
    return Source(Model('torque_pendulum'), TopicMap())


def until_taken(renewing: Renewing, count: int) -> None:
    end = time.monotonic() + PATIENCE
    while not renewing.look(count):
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.fixture
def renewing(source, contents):
    state = State(source.scene(contents[0]))
    renewing = Renewing(source, state, lambda: contents[1])
    yield renewing
    renewing.end()


def test_new_data_come_in_and_the_switches_stay(renewing):
    state = renewing._state
    state.switch('coulomb_friction:pivot', True)
    before, setting, told = state.scene, state.setting, []
    state.listeners.append(lambda: told.append(1))
    until_taken(renewing, 1)
    assert state.scene is not before and state.setting == setting and told
    assert state.sizes[1] < state.sizes[0]
    assert state.player.now == pytest.approx(state.player.length)


def test_nothing_is_computed_without_new_messages_or_while_data_are_held(renewing):
    renewing.freeze(True)
    assert not renewing.look(1) and renewing._future is None
    renewing.freeze(False)
    assert not renewing.look(0) and renewing._future is None


def test_a_switch_that_was_moved_meanwhile_is_not_undone(renewing):
    state = renewing._state
    renewing.look(1)
    state.switch('coulomb_friction:pivot', True)
    until_taken(renewing, 1)
    assert 'coulomb_friction:pivot' in state.setting.on


def test_data_that_do_not_do_are_said_and_what_was_shown_stays(renewing, contents):
    state, nothing = renewing._state, BagContents(contents[0].path, (), {}, {}, True, 0)
    before, renewing._contents = state.scene, lambda: nothing
    until_taken(renewing, 1)
    assert renewing.news.trouble and state.scene is before
