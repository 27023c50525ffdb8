# SPDX-License-Identifier: Apache-2.0
"""How far the graph reaches and how soon the dead are noticed, before rclpy starts.

Set as ROS's own environment variables, and only where the user has not set them.
"""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
import re

from leo_msgs_py.errors import UserError

REACH = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
RANGES = ('LOCALHOST', 'SUBNET', 'OFF', 'SYSTEM_DEFAULT')
LAST_DOMAIN = 232
SHARED_MEMORY = Path('/dev/shm')
_SEGMENT = re.compile(r'fastrtps_(?:port\d+|[0-9a-f]{16})')
_PROFILES = Path(__file__).parent / 'dds'
_FAST_DDS = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
_FAST_DDS_FILES = ('DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml')


def prepare() -> None:
    """Keep to this machine, notice killed nodes after 4 s, clear away what they left.

    Raises:
        UserError: ROS_DOMAIN_ID or the discovery range is none.
    """
    _check_environment()
    os.environ[REACH] = os.environ.get(REACH) or RANGES[0]
    if not any(name in os.environ for name in _FAST_DDS) and not any(
        Path(name).exists() for name in _FAST_DDS_FILES
    ):
        os.environ[_FAST_DDS[0]] = str(_PROFILES / 'fastdds.xml')
    os.environ.setdefault('CYCLONEDDS_URI', f'file://{_PROFILES / "cyclonedds.xml"}')
    clear_shared_memory()


def describe(middleware: str) -> str:
    """Middleware, domain and reach in words."""
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    return f'{middleware}, ROS_DOMAIN_ID {domain}, reach {os.environ.get(REACH) or "SUBNET"}'


def clear_shared_memory() -> None:
    """Remove Fast DDS's segments and ports in /dev/shm whose process was killed.

    A living process holds a lock on the file that ends in `_el`, or `_sl` where several share it.
    """
    found = (_SEGMENT.match(file.name) for file in SHARED_MEMORY.glob('fastrtps_*'))
    for name in {match[0] for match in found if match}:
        locks = [SHARED_MEMORY / f'{name}_el', SHARED_MEMORY / f'{name}_sl']
        if not any(_is_held(lock) for lock in locks):
            for file in (SHARED_MEMORY / name, SHARED_MEMORY / f'sem.{name}_mutex', *locks):
                _remove(file)


def _is_held(file: Path) -> bool:
    try:
        with file.open('rb') as stream:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except OSError:
        return True
    return False


def _remove(file: Path) -> None:
    try:
        file.unlink(missing_ok=True)
    except OSError:
        return  # another user's


def _check_environment() -> None:
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    if not domain.isdecimal() or int(domain) > LAST_DOMAIN:
        raise UserError(f'ROS_DOMAIN_ID={domain!r} is not a number from 0 to {LAST_DOMAIN}')
    reach = os.environ.get(REACH) or RANGES[0]
    if reach not in RANGES:
        raise UserError(f'{REACH}={reach!r} is none of {", ".join(RANGES)}')
