# SPDX-License-Identifier: Apache-2.0
"""Robot processes for tests."""

from collections.abc import Callable, Iterator

import pytest
from tests.graph.robot_process import Robot


@pytest.fixture
def robots(node, spawn, tmp_path, monkeypatch) -> Iterator[Callable[..., Robot]]:
    """Starts robots, as processes of `spawn`."""
    monkeypatch.setenv('XDG_RUNTIME_DIR', str(tmp_path))
    started = []

    def start(space: str, **parameters) -> Robot:
        folder = tmp_path / space.strip('/')
        folder.mkdir()
        started.append(Robot(node, spawn, folder, space, **parameters))
        return started[-1]

    yield start
    for robot in started:
        robot.log.close()
