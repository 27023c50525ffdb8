# SPDX-License-Identifier: Apache-2.0
"""`leo play MOTION` on a model: its bag, its episodes, and what it refuses."""

import json

import numpy as np
import pytest

from leo_diffmodel.bags.recording import read_bag
from leo_learner.training import loop
from leo_learner.verbs.play import main
from leo_msgs_py.errors import UserError


def test_a_hanging_robot_is_recorded_as_held(tmp_path, capsys):
    bag = tmp_path / 'hang'
    args = ['swinging', '--model', 'leo', '--seconds', '0.6', '--bag', str(bag)]
    assert main([*args, '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert told['falls'] == 0 and told['seconds'] == pytest.approx(0.6) and told['complete']
    recording = read_bag(bag, 'leo')
    (episode,) = recording.episodes
    assert recording.held and len(episode.t) == 21
    assert not np.ptp(episode.q[:, :3], axis=0).any()
    with pytest.raises(UserError, match='exists'):
        main(args)


def test_every_fall_begins_an_episode(tmp_path, capsys):
    bag = tmp_path / 'step'
    args = ['stepping', '--model', 'leo', '--seconds', '3', '--seed', '0', '--bag', str(bag)]
    assert main(args) == 0
    said, recording = capsys.readouterr().out, read_bag(bag, 'leo')
    falls = len(recording.episodes) - 1
    assert falls >= 1 and f'{falls} fall' in said and 'leo check' in said and not recording.held


def test_the_episodes_before_ctrl_c_are_in_the_bag(tmp_path, capsys, monkeypatch):
    def two(env, act, episodes, *rest):
        play(env, act, 2, *rest)
        raise KeyboardInterrupt

    play = loop.play
    monkeypatch.setattr(loop, 'play', two)
    bag = tmp_path / 'stopped'
    with pytest.raises(KeyboardInterrupt):
        main(['leo_walk', '--model', 'leo', '--episodes', '9', '--bag', str(bag)])
    assert f'stopped: wrote {bag}' in capsys.readouterr().err
    assert len(read_bag(bag, 'leo').episodes) == 2


@pytest.mark.parametrize(
    ('args', 'said'),
    [
        (['steping'], 'did you mean stepping'),
        (['stepping', '--model', 'pendulum'], 'need left_hip'),
        (['stepping', '--seconds', '0'], 'length of a motion'),
        (['leo_walk', '--seconds', '3'], 'length of a motion'),
        (['swinging', '--collect', '3'], 'takes --seconds and --seed'),
    ],
)
def test_what_cannot_be_is_said_in_one_line(args, said):
    with pytest.raises(UserError, match=said) as caught:
        main(args)
    assert len(str(caught.value).splitlines()) == 1
