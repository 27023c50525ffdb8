# SPDX-License-Identifier: Apache-2.0
"""The episode number grows over restarts, however the process ended."""

import pytest

from leo_msgs_py.errors import UserError
from leo_sim.nodes.publishers import episode_file, EpisodeNumber


def test_a_restart_goes_on_with_the_next_number(tmp_path):
    first = EpisodeNumber(tmp_path / 'leo' / 'episode')
    assert first.value == 0 and first.next() == 1 and first.next(2) == 3
    assert EpisodeNumber(tmp_path / 'leo' / 'episode').value == 4


def test_a_given_number_wins_and_after_the_last_comes_0(tmp_path):
    EpisodeNumber(tmp_path / 'episode').next()
    assert EpisodeNumber(tmp_path / 'episode', first=0).value == 0
    EpisodeNumber(tmp_path / 'episode', first=2**32 - 1)
    assert EpisodeNumber(tmp_path / 'episode').value == 0


def test_a_broken_file_counts_as_none(tmp_path):
    (tmp_path / 'episode').write_text('not a number')
    assert EpisodeNumber(tmp_path / 'episode').value == 0


def test_a_folder_that_cannot_be_written_is_said(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(UserError, match='set XDG_RUNTIME_DIR'):
        EpisodeNumber(tmp_path / 'file' / 'episode')


def test_each_domain_and_node_has_its_own_file(monkeypatch, tmp_path):
    monkeypatch.setenv('XDG_RUNTIME_DIR', str(tmp_path))
    monkeypatch.setenv('ROS_DOMAIN_ID', '7')
    other = episode_file('/a/robot')
    assert other.parent == tmp_path / 'leo'
    assert len({other, episode_file('/b/robot'), episode_file('/robot')}) == 3
    monkeypatch.setenv('ROS_DOMAIN_ID', '8')
    assert episode_file('/a/robot') != other
