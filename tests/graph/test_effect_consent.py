# SPDX-License-Identifier: Apache-2.0
"""Nodes run a Python file that a model names only where a parameter names it too."""

from contextlib import suppress
from pathlib import Path
import subprocess
import sys

import pytest
from tests.commands import LEO
from tests.unit.leo_sim.common.test_consent import LAW, WIND
import yaml

from leo_msgs_py.cli import main
from leo_msgs_py.node import call, spin_until

pytestmark = pytest.mark.graph
NODES = {
    'robot': ['leo_sim', 'robot', '-p', 'robot:=pendulum', '-p', 'hidden:=model.yaml'],
    'diffmodel': ['leo_diffmodel', 'diffmodel', '-p', 'record:=false', '-p', 'model:=model.yaml'],
    'learner': ['leo_learner', 'learner', '-p', 'model:=model.yaml', '-p', 'first_steps:=0'],
}


@pytest.fixture
def folder(tmp_path) -> Path:
    (tmp_path / 'wind.py').write_text(LAW)
    (tmp_path / 'model.yaml').write_text(yaml.safe_dump({'robot': 'pendulum', 'effects': [WIND]}))
    return tmp_path


def command(name: str, *given: str) -> list[str]:
    package, executable, *parameters = NODES[name]
    return ['run', package, executable, '--ros-args', *parameters, *given]


@pytest.mark.parametrize('name', NODES)
@pytest.mark.usefixtures('domain')
def test_a_node_refuses(name, folder, monkeypatch, capfd):
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, 'argv', sys.argv)
    assert main(command(name)) == 2
    (line,) = [x for x in capfd.readouterr().err.splitlines() if x.startswith('leo: error')]
    assert '-p effect:=wind.py' in line
    assert not (folder / 'ran').exists()


@pytest.mark.parametrize('name', NODES)
def test_a_node_runs_what_its_parameter_names_and_tells_nobody(name, folder, node):
    from rcl_interfaces.srv import ListParameters

    process = subprocess.Popen([LEO, *command(name, '-p', 'effect:=wind.py')], cwd=folder)
    try:
        assert spin_until(lambda: (folder / 'ran').exists(), 120.0)
        client = node.create_client(ListParameters, f'/{name}/list_parameters')
        listed: list[str] = []
        for _ in range(12):  # DDS may lose an answer that is sent before its reader is discovered
            with suppress(TimeoutError):
                listed = call(client, ListParameters.Request(), 10.0).result.names
                break
        assert 'robot' in listed or 'model' in listed
        assert 'effect' not in listed
    finally:
        process.terminate()
        process.wait(30)
