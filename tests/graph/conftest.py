# SPDX-License-Identifier: Apache-2.0
"""Robot processes for tests."""

from collections.abc import Callable, Iterator

import pytest
from tests.graph.robot_process import PATIENCE, Robot


@pytest.fixture
def robots(node, tmp_path, monkeypatch) -> Iterator[Callable[..., Robot]]:
    """Starts robots and ends them, whatever happens."""
    monkeypatch.setenv('XDG_RUNTIME_DIR', str(tmp_path))
    started = []

    def start(space: str, **parameters) -> Robot:
        folder = tmp_path / space.strip('/')
        folder.mkdir()
        started.append(Robot(node, folder, space, **parameters))
        return started[-1]

    yield start
    for robot in started:
        if robot.process.poll() is None:
            robot.process.kill()
            robot.process.wait(PATIENCE)
        robot.log.close()
