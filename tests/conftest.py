# SPDX-License-Identifier: Apache-2.0
"""Fixtures of tests that talk over ROS: a domain of their own, a node, processes that end."""

from collections.abc import Callable, Generator, Iterator
import gc
import os
import secrets
import signal
import subprocess
import sys
from typing import Any

from hypothesis import HealthCheck, settings
import pytest
from tests.machine import described

from leo_learner.demo.processes import free_domain

Spawn = Callable[..., subprocess.Popen]


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """Let signals interrupt again, which a shell that starts the tests behind it has ignored.

    One seed of hypothesis for all processes: the same each time where CI decides what lands, drawn
    elsewhere. No example fails for being slow: the machine may be busy.
    """
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)
    given = getattr(config, 'workerinput', {}).get('seed') or config.option.hypothesis_seed
    drawn = '1' if 'CI' in os.environ else str(secrets.randbits(32))
    config.option.hypothesis_seed = given or drawn
    settings.register_profile(
        'patient', deadline=None, derandomize=False, suppress_health_check=[HealthCheck.too_slow]
    )
    settings.load_profile('patient')


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Hand the seed to a process of xdist."""
    node.workerinput['seed'] = node.config.option.hypothesis_seed


def pytest_report_header(config: pytest.Config) -> list[str]:
    """What a failure elsewhere is repeated with."""
    return described(config.option.hypothesis_seed)


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """The processor time of all processes of the run."""
    used = os.times()
    seconds = used.user + used.system + used.children_user + used.children_system
    terminalreporter.write_line(f'CPU: {seconds / 60:.1f} minutes')


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """One process more than cores: the one that has tests/graph mostly waits."""
    return (os.cpu_count() or 1) + 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Deal out whole files to processes, so that what a file shares is made once.

    The files of tests/graph all go to one process, where none takes another's processor time.
    (Marks of xdist's own groups are lost on pytest 9.)
    """
    from xdist.scheduler import LoadScopeScheduling

    class ByFile(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file = nodeid.partition('::')[0]
            return 'graph' if file.startswith('tests/graph/') else file

    config.option.loadscopereorder = False
    return ByFile(config, log)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, Any, Any]:
    """Look for no garbage while tests are collected, nor later in what that made, which stays."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What takes longest begins first; the short tests of unit/leo_sim come last anyway."""
    items.sort(key=lambda item: not item.nodeid.startswith('tests/graph/'))


@pytest.fixture(scope='session')
def domain() -> Iterator[int]:
    """A ROS_DOMAIN_ID of its own for this test process and its children, on localhost."""
    with free_domain() as number, pytest.MonkeyPatch.context() as patch:
        patch.setenv('ROS_DOMAIN_ID', str(number))
        patch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
        yield number


@pytest.fixture
def node(spawn: Spawn) -> Iterator[Any]:
    """A node of this process, joined to the test's domain; it leaves before others are killed."""
    from rclpy.node import Node

    from leo_msgs_py.node import graph, join

    with graph(['--ros-args', '--log-level', 'warn']):
        yield join(Node('tester'))


@pytest.fixture
def spawn(domain: int) -> Iterator[Spawn]:
    """Start Python processes in the test's domain; they are killed at the end.

    What joins the graph in this process uses this fixture, so that it has left by then: a process
    killed with a lock of Fast DDS's shared memory has one that leaves wait for ever, or crash.
    """
    running: list[subprocess.Popen] = []

    def start(*args: str, **options: object) -> subprocess.Popen:
        child = subprocess.Popen([sys.executable, *args], text=True, **options)
        running.append(child)
        return child

    yield start
    for child in running:
        child.kill()
        child.communicate()
