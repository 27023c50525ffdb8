# SPDX-License-Identifier: Apache-2.0
"""The page's state on what was measured meanwhile, and the difference model's share."""

from dataclasses import replace

import pytest
from tests.patience import until
from tests.simulate import bag, record, TORQUE

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.difference.data import transitions
from leo_diffmodel.difference.fit import fit
from leo_diffmodel.difference.network import RECOMMENDED
from leo_diffmodel.watch.live.renewing import Renewing, Sharer, Source
from leo_diffmodel.watch.state import State
from leo_msgs_py.bag_contents import BagContents, load
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import OtherRobot
from leo_sim.effects import place
from leo_sim.model import Model

FRICTION = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2)
MODEL = Model('torque_pendulum')
QUIET = (1e-5, 1e-4)
DRAG = place(TORQUE, 'viscous_friction', 'pivot', b=0.1)


@pytest.fixture(scope='module')
def contents(tmp_path_factory):
    folder = tmp_path_factory.mktemp('live')
    runs = (record(TORQUE, FRICTION, seconds=12, seed=seed) for seed in (1, 2))
    return [load(bag(folder / run.path.name, run)) for run in runs]


@pytest.fixture
def source():
    return Source(MODEL, TopicMap())


@pytest.fixture
def renewing(source, contents):
    renewing = Renewing(source, State(source.scene(contents[0])), lambda: contents[1])
    yield renewing
    renewing.end()


def test_new_data_come_in_and_the_switches_stay(renewing):
    state = renewing._state
    state.switch('coulomb_friction:pivot', True)
    before, setting, told = state.scene, state.setting, []
    state.listeners.append(lambda: told.append(1))
    until(lambda: renewing.look(1))
    assert state.scene is not before and state.setting == setting and told
    assert state.sizes[1] < state.sizes[0]
    assert state.player.now == pytest.approx(state.player.length)


def test_nothing_is_computed_without_new_messages_or_while_data_are_held(renewing):
    renewing.toggle()
    assert not renewing.look(1) and renewing._future is None
    renewing.toggle()
    assert not renewing.look(0) and renewing._future is None


def test_a_switch_that_was_moved_meanwhile_is_not_undone(renewing):
    state = renewing._state
    renewing.look(1)
    state.switch('coulomb_friction:pivot', True)
    until(lambda: renewing.look(1))
    assert 'coulomb_friction:pivot' in state.setting.on


def test_data_that_do_not_do_are_said_and_what_was_shown_stays(renewing, contents):
    state, nothing = renewing._state, BagContents(contents[0].path, (), {}, {}, True, 0)
    before, renewing._contents = state.scene, lambda: nothing
    until(lambda: renewing.look(1))
    assert renewing.news.trouble and state.scene is before


@pytest.mark.parametrize(
    ('model', 'named', 'said'),
    [
        ('pendulum', 'torque_pendulum', "the running robot is 'torque_pendulum'"),
        ('double_pendulum', '', 'joints shoulder, elbow are not on /joint_states'),
    ],
)
def test_another_robot_is_known_by_its_name_or_its_joints(contents, model, named, said):
    heard = replace(contents[0], metadata={'leo': {'robot': named}})
    with pytest.raises(OtherRobot, match=said):
        Source(Model(model), TopicMap()).scene(heard)


@pytest.mark.parametrize('named', ['', 'torque_pendulum', 'a_folder/elsewhere'])
def test_a_robot_that_names_no_other_one_is_taken(source, contents, named):
    assert source.scene(replace(contents[0], metadata={'leo': {'robot': named}})).recordings


@pytest.fixture(scope='module')
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp('share') / 'bag'
    return read_bag(bag(folder, record(TORQUE, DRAG, seconds=30, noise=QUIET)), TORQUE)


@pytest.fixture(scope='module')
def fitted(recording):
    config = replace(RECOMMENDED, hidden=(32, 32), epochs=60)
    return fit(transitions([recording], MODEL), MODEL, config)[0]


def test_a_model_that_was_fitted_takes_most_of_the_error(recording, fitted):
    share = Sharer(MODEL).share(fitted.to_bytes(), recording)
    assert share.corrected < 0.7 * share.without
    assert 'takes' in share.words and 'of the one-step error' in share.words


def test_without_weights_and_for_another_robot_there_is_none(recording, fitted):
    assert Sharer(MODEL).share(b'', recording) is None
    assert Sharer(MODEL).share(replace(fitted, robot='pendulum').to_bytes(), recording) is None


def test_weights_that_are_none_are_refused(recording):
    with pytest.raises(UserError):
        Sharer(MODEL).share(b'nothing', recording)
