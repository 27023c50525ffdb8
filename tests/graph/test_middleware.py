# SPDX-License-Identifier: Apache-2.0
"""What is set before rclpy starts, and what killed processes leave behind."""

import os
from pathlib import Path
import re
import time

import pytest
from tests.patience import PATIENCE

from leo_msgs_py import middleware
from leo_msgs_py.errors import UserError
from leo_msgs_py.middleware import clear_shared_memory, prepare
from leo_msgs_py.node import spin_until

PEER = str(Path(__file__).with_name('peer.py'))
REACH = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
FAST_DDS = 'FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE'
CYCLONE = 'CYCLONEDDS_URI'


@pytest.fixture
def fresh(monkeypatch, tmp_path):
    for name in (REACH, CYCLONE, 'ROS_DOMAIN_ID', *FAST_DDS):
        monkeypatch.setenv(name, '')  # so that what `prepare` sets is taken back
        monkeypatch.delenv(name)
    monkeypatch.setattr(middleware, 'clear_shared_memory', lambda: None)
    monkeypatch.chdir(tmp_path)
    return monkeypatch


def test_it_stays_on_this_machine_and_notices_the_dead(fresh):
    prepare()
    assert os.environ[REACH] == 'LOCALHOST'
    for text in (os.environ[FAST_DDS[0]], os.environ[CYCLONE].removeprefix('file://')):
        assert re.search(r'<(leaseDuration><sec>4<|LeaseDuration>4 s<)', Path(text).read_text())


CHOSEN = [(REACH, reach) for reach in ('SUBNET', 'OFF', 'SYSTEM_DEFAULT')]


@pytest.mark.parametrize(
    ('name', 'value'), [*CHOSEN, *((name, 'mine.xml') for name in (*FAST_DDS, CYCLONE))]
)
def test_a_reach_or_a_profile_the_user_chose_is_kept(fresh, name, value):
    fresh.setenv(name, value)
    prepare()
    assert os.environ[name] == value
    assert (FAST_DDS[0] in os.environ) == (name != FAST_DDS[1])


def test_a_profile_in_the_working_folder_is_kept(fresh):
    Path('DEFAULT_FASTRTPS_PROFILES.xml').write_text('<profiles/>')
    prepare()
    assert FAST_DDS[0] not in os.environ


@pytest.mark.parametrize(
    ('name', 'value'), [('ROS_DOMAIN_ID', 'many'), ('ROS_DOMAIN_ID', '233'), (REACH, 'MOON')]
)
def test_a_value_that_is_none_is_refused(fresh, name, value):
    fresh.setenv(name, value)
    with pytest.raises(UserError, match=f'^{name}={value!r} is '):
        prepare()


def locks(pid: int) -> set[Path]:
    """The lock files of Fast DDS's shared memory that a process has open."""
    opened = [Path(os.readlink(fd)) for fd in Path(f'/proc/{pid}/fd').iterdir()]
    return {file for file in opened if re.fullmatch(r'/dev/shm/fastrtps_\w+_[es]l', str(file))}


def files(lock: Path) -> list[Path]:
    """A lock file and what it stands for."""
    return [lock, lock.with_name(lock.name[:-3])]


@pytest.mark.graph
def test_what_a_killed_process_held_is_removed_and_nothing_of_a_living_one(node, spawn):
    peers = [spawn(PEER, '--ros-args', '-r', f'__ns:=/{name}') for name in ('left', 'right')]

    def talkers() -> set[str]:
        return {space for name, space in node.get_node_names_and_namespaces() if name == 'talker'}

    assert spin_until(lambda: talkers() == {'/left', '/right'}, PATIENCE)
    left, right = (locks(peer.pid) for peer in peers)
    assert left and right and not left & right
    assert not any('port' in lock.name for lock in left), 'whoever is killed in it is waited for'
    peers[0].kill()
    peers[0].wait()
    killed = time.monotonic()
    clear_shared_memory()
    assert not any(file.exists() for lock in left for file in files(lock))
    assert locks(peers[1].pid) == right
    assert all(file.exists() for lock in right for file in files(lock))
    assert spin_until(lambda: talkers() == {'/right'}, PATIENCE)
    assert time.monotonic() - killed < 18.0, 'a killed node is gone after 4 s, not after 20'


def test_files_of_others_and_files_in_the_making_are_left_alone(monkeypatch, tmp_path):
    monkeypatch.setattr(middleware, 'SHARED_MEMORY', tmp_path)
    kept = 'fastrtps_port7400', 'sem.fastrtps_port7400_mutex', 'fastrtps_mine_el', 'other_el'
    dead = 'fastrtps_0123456789abcdef', 'fastrtps_0123456789abcdef_el', 'fastrtps_port1_sl'
    for name in (*kept, *dead):
        (tmp_path / name).touch()
    clear_shared_memory()
    assert {file.name for file in tmp_path.iterdir()} == set(kept)
