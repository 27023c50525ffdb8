# SPDX-License-Identifier: Apache-2.0
"""Algorithm 5 as three processes over DDS, each killed and started again on the way."""

import json
from pathlib import Path
import subprocess
import time

import pytest
from tests.commands import start_node

from leo_diffmodel.bags.finish import recorded
from leo_diffmodel.bags.recording import read_bag
from leo_learner.learning.policy import Policy
from leo_sim.model.model_file import load_model

pytestmark = pytest.mark.graph

HIDDEN = """\
effects:
  - {name: link_mass, where: bob, parameters: {m: {value: 0.035, unit: kg}}}
"""


class Graph:
    def __init__(self, spawn, folder: Path) -> None:
        (folder / 'hidden.yaml').write_text(HIDDEN)
        self._spawn, self._folder = spawn, folder
        robot = f'robot:=pendulum realtime_factor:=0 start:=random hidden:={folder}/hidden.yaml'
        model = f'model:=pendulum repair:=true bag:={folder}/rollout'
        learner = f'folder:={folder}/run first_steps:=100 update_steps:=100 transitions:=500'
        self._arguments = {
            'robot': ['leo_sim', *robot.split(), 'noise:=[0.001,0.02]'],
            'diffmodel': ['leo_diffmodel', *model.split()],
            'learner': ['leo_learner', 'model:=pendulum', *learner.split(), 'tests:=1'],
        }
        self._processes: dict[str, subprocess.Popen] = {}
        for name in self._arguments:
            self.start(name)

    def start(self, name: str) -> None:
        package, *given = self._arguments[name]
        with (self._folder / f'{name}.log').open('a') as log:
            started = start_node(self._spawn, package, name, *given, stdout=log, stderr=log)
        self._processes[name] = started

    def kill_and_restart(self, name: str) -> None:
        self._processes[name].kill()
        self._processes[name].wait()
        self.start(name)

    def wait_for(self, text: str, times: int = 1, seconds: float = 600.0) -> None:
        log, until = self._folder / 'learner.log', time.monotonic() + seconds
        while log.read_text().count(text) < times:
            assert time.monotonic() < until, f'no {text!r} in:\n{log.read_text()}'
            time.sleep(0.05)


def test_every_process_may_be_killed_and_named_effects_move_into_the_model(spawn, tmp_path):
    graph = Graph(spawn, tmp_path)
    graph.wait_for('gathering 500')
    time.sleep(0.5)
    graph.kill_and_restart('robot')
    graph.wait_for('updating the difference model')
    graph.wait_for('accepted')
    graph.kill_and_restart('diffmodel')
    graph.wait_for('round 1: training')
    graph.kill_and_restart('learner')
    graph.wait_for('round 1: training', times=2)
    graph.wait_for('done; best policy')

    done = json.loads((tmp_path / 'run' / 'algorithm5.json').read_text())
    assert done['phase'] == 'end' and done['version'] >= 1 and len(done['tests']) == 2
    assert Policy.load(tmp_path / 'run' / 'round-1' / 'policy.safetensors').robot == 'pendulum'
    samples = sum(
        len(e.t)
        for bag in recorded(tmp_path / 'rollout')
        for e in read_bag(bag, 'pendulum').episodes
    )
    assert samples > 5 * 500
    assert 'on top of link_mass at bob' in (tmp_path / 'learner.log').read_text()
    newest = max((tmp_path / 'run').glob('difference-*.yaml'))
    [effect] = load_model(newest).effects
    assert effect.parameters['m'] == pytest.approx(0.035, rel=0.05)
