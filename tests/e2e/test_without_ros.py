# SPDX-License-Identifier: Apache-2.0
"""Without ROS everything works but the graph, which says in one line what is missing."""

import json
import os
from pathlib import Path
import subprocess
import sys

import pytest
from tests.architecture.test_source import ROS
from tests.simulate import bag, PENDULUM, record

BLOCKER = f"""
import sys

class NoRos:
    def find_spec(self, name, path=None, target=None):
        if name.partition('.')[0] in {ROS!r}:
            raise ModuleNotFoundError(f'No module named {{name!r}}', name=name)

sys.meta_path.insert(0, NoRos())
"""
LEO = 'import sys; from leo_msgs_py.cli import main; sys.exit(main(sys.argv[1:]))'


@pytest.fixture
def leo(tmp_path):
    """Run a command in an environment without ROS, in a folder of its own."""
    (tmp_path / 'site').mkdir()
    (tmp_path / 'site' / 'sitecustomize.py').write_text(BLOCKER)  # children have it too
    paths = [str(tmp_path / 'site'), *filter(None, [os.environ.get('PYTHONPATH')])]
    environment = os.environ | {'PYTHONPATH': os.pathsep.join(paths)}

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, '-c', LEO, *words], env=environment, cwd=tmp_path,
                              capture_output=True, text=True, timeout=300)  # fmt: skip

    return run


@pytest.mark.parametrize('verb', ['explain', 'run', 'topic', 'learn', 'play', 'bag'])
def test_help_works(leo, verb):
    done = leo(verb, '--help')
    assert (done.returncode, done.stderr) == (0, '')
    assert f'  leo {verb} ' in done.stdout


def test_bags_models_and_learning_work(leo, tmp_path: Path):
    bag(tmp_path / 'swing', record(PENDULUM, seconds=5))
    for words in (['bag', 'info', 'swing'], ['compare', 'swing', '--model', 'pendulum', '--json'],
                  ['learn', '--model', 'pendulum', '--steps', '100', '-o', 'run', '--json']):
        done = leo(*words)
        assert done.returncode == 0, done.stderr
    policy = json.loads(done.stdout.splitlines()[-1])['policy']
    done = leo('play', policy, '--model', 'pendulum', '--json')
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    'words',
    [
        ['run', 'leo_sim', 'robot'],
        ['run', 'leo_diffmodel', 'diffmodel'],
        ['run', 'leo_learner', 'learner'],
        ['topic', 'list'],
        ['status'],
        ['bag', 'record'],
        ['play', 'leo_walk'],
        ['learn', '--robot', 'pendulum', '--on-robot', '-o', 'x', '--steps', '10'],
    ],
)
def test_what_needs_ros_says_so_in_one_line(leo, words):
    done = leo(*words)
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr.startswith('leo: error: this needs ROS 2') and done.stderr.count('\n') == 1
    assert './run_all.sh setup' in done.stderr
