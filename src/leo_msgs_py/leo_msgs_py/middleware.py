# SPDX-License-Identifier: Apache-2.0
"""How far the graph reaches and how soon the dead are noticed, before rclpy starts.

Set as ROS's own environment variables, and only where the user has not set them.
"""

from contextlib import ExitStack
import fcntl
import os
from pathlib import Path
import re

from leo_msgs_py.errors import UserError

REACH = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
RANGES = ('LOCALHOST', 'SUBNET', 'OFF', 'SYSTEM_DEFAULT')
LAST_DOMAIN = 232
SHARED_MEMORY = Path('/dev/shm')
_LOCK = re.compile(r'(fastrtps_(?:port\d+|[0-9a-f]{16}))_[es]l')
_PROFILES = Path(__file__).parent / 'dds'
_FAST_DDS = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
_FAST_DDS_FILES = ('DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml')


def prepare() -> None:
    """Keep to this machine, notice and repair losses soon, clear away what killed nodes left.

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
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    return f'{middleware}, ROS_DOMAIN_ID {domain}, reach {os.environ.get(REACH) or "SUBNET"}'


def clear_shared_memory() -> None:
    """Remove Fast DDS's segments and ports in /dev/shm whose process was killed.

    Each has a file that ends in `_el`, or `_sl` where several processes share it, and that a
    living process holds locked. One without that file is just being made.
    """
    found = (_LOCK.fullmatch(file.name) for file in SHARED_MEMORY.glob('fastrtps_*_[es]l'))
    for name in {match[1] for match in found if match}:
        _clear(name)


def _clear(name: str) -> None:
    locks = [file for end in ('_el', '_sl') if (file := SHARED_MEMORY / f'{name}{end}').exists()]
    try:
        with ExitStack() as opened:
            for lock in locks:
                stream = opened.enter_context(lock.open('rb'))
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            for file in (SHARED_MEMORY / name, SHARED_MEMORY / f'sem.{name}_mutex', *locks):
                file.unlink(missing_ok=True)
    except OSError:
        return  # held, gone meanwhile, or another user's


def _check_environment() -> None:
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    if not domain.isdecimal() or int(domain) > LAST_DOMAIN:
        raise UserError(f'ROS_DOMAIN_ID={domain!r} is not a number from 0 to {LAST_DOMAIN}')
    reach = os.environ.get(REACH) or RANGES[0]
    if reach not in RANGES:
        raise UserError(f'{REACH}={reach!r} is none of {", ".join(RANGES)}')
