# SPDX-License-Identifier: Apache-2.0
"""What need not be installed is missed by what needs it alone, which says so in one line."""

import json
import os
from pathlib import Path
import subprocess
import sys

import pytest
from tests.architecture.test_imports import ROS
from tests.commands import CODE
from tests.simulate import bag, PENDULUM, record

from leo_msgs_py import cli

EXTRAS = {*cli._EXTRAS, 'mujoco'}
BLOCKER = """
import sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition('.')[0] in {!r}:
            raise ModuleNotFoundError('No module named ' + repr(name), name=name)

sys.meta_path.insert(0, Missing())
"""
EACH = """
import contextlib, io, json, sys
from leo_msgs_py.cli import main

def said(words):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = main(words)
        except SystemExit as end:
            status = end.code
    return status, out.getvalue(), err.getvalue()

print(json.dumps([said(words) for words in json.loads(sys.argv[1])]))
"""


@pytest.fixture
def python(request, tmp_path):
    """Run a program in an environment without ROS, or others, in a folder of its own."""
    blocker = BLOCKER.format(getattr(request, 'param', ROS))
    (tmp_path / 'site').mkdir()
    (tmp_path / 'site' / 'sitecustomize.py').write_text(blocker)  # children have it too
    paths = [str(tmp_path / 'site'), *filter(None, [os.environ.get('PYTHONPATH')])]
    environment = os.environ | {'PYTHONPATH': os.pathsep.join(paths)}

    def run(program: str, *words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, '-c', program, *words],
            env=environment,
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=300,
        )

    return run


def test_help_works(python):
    verbs = ['explain', 'run', 'topic', 'learn', 'play', 'bag']
    done = python(EACH, json.dumps([[verb, '--help'] for verb in verbs]))
    for verb, (status, out, err) in zip(verbs, json.loads(done.stdout), strict=True):
        assert (status, err) == (0, '')
        assert f'  leo {verb} ' in out


def test_bags_models_and_learning_work(python, tmp_path: Path):
    bag(tmp_path / 'swing', record(PENDULUM, seconds=5))
    for words in (
        ['bag', 'info', 'swing'],
        ['compare', 'swing', '--model', 'pendulum', '--json'],
        ['learn', '--model', 'pendulum', '--steps', '100', '-o', 'run', '--json'],
    ):
        done = python(CODE, *words)
        assert done.returncode == 0, done.stderr
    policy = json.loads(done.stdout.splitlines()[-1])['policy']
    done = python(CODE, 'play', policy, '--model', 'pendulum', '--json')
    assert done.returncode == 0, done.stderr


NEED_ROS = (
    ['run', 'leo_sim', 'robot'],
    ['run', 'leo_diffmodel', 'diffmodel'],
    ['run', 'leo_learner', 'learner'],
    ['topic', 'list'],
    ['status'],
    ['bag', 'record'],
    ['play', 'leo_walk'],
    ['learn', '--robot', 'pendulum', '--on-robot', '-o', 'x', '--steps', '10'],
)


def test_what_needs_ros_says_so_in_one_line(python):
    done = python(EACH, json.dumps(NEED_ROS))
    for words, (status, out, err) in zip(NEED_ROS, json.loads(done.stdout), strict=True):
        assert (status, out) == (2, ''), words
        assert err.startswith('leo: error: this needs ROS 2') and err.count('\n') == 1, words
        assert './run_all.sh setup' in err


@pytest.mark.parametrize('python', [EXTRAS], indirect=True, ids=['extras'])
def test_a_log_is_explained_without_what_learning_and_driving_need(python, tmp_path: Path):
    bag(tmp_path / 'swing', record(PENDULUM, seconds=6))
    done = python(CODE, 'explain', 'swing', '--model', 'pendulum', '-o', 'out')
    assert done.returncode == 0, done.stderr
    assert (tmp_path / 'out' / 'report.html').is_file()
    needing = {
        'torch': ['learn', '--model', 'pendulum', '--steps', '10', '-o', 'x'],
        'dynamixel_sdk': ['check-driver', 'dynamixel', '--robot', 'leo', '--port', '/dev/null'],
    }
    done = python(EACH, json.dumps([*needing.values()]))
    for package, (status, _, err) in zip(needing, json.loads(done.stdout), strict=True):
        assert status == 2 and err.count('\n') == 1, err
        assert err.startswith(f'leo: error: this needs {package}') and 'pip install' in err
