# SPDX-License-Identifier: Apache-2.0
"""The main job, small: every step of `leo demo` on a robot with a secret; and the quick one."""

import io
import json
import os
from pathlib import Path
import time

import numpy as np
import pytest
from rich.console import Console

from leo_learner.demo.main_job import closing, MainJob, Plan
from leo_learner.demo.processes import Processes
from leo_learner.verbs.demo import SHIPPED
from leo_msgs_py.cli import main
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.truth.drawing import draw
from leo_sim.verbs.reveal import read_sealed

SMALL = Plan(steps=200, more_steps=200, transitions=300, episodes=1)


@pytest.mark.graph
def test_names_the_secret_and_says_how_good_it_was(tmp_path):
    text = io.StringIO()
    console = Console(file=text, width=120)
    found = MainJob(tmp_path, SMALL, console, None).run()
    closing(found, tmp_path, console)
    truth = found.truth['effects'][0]
    named = {e['name'] for e in found.repair['effects']}
    alternatives = {c['name'] for e in found.repair['effects'] for c in e['confusable_with']}
    assert truth['name'] in named | alternatives
    assert set(found.returns) == {'ideal', 'repaired', 'real'}
    assert json.loads((tmp_path / 'demo.json').read_text())['truth'] == found.truth
    assert (tmp_path / 'repair' / 'report.html').stat().st_size < 5_000_000
    said = text.getvalue()
    assert truth['name'] in said and 'noise floor' in said and 'report.html' in said
    assert f'leo watch {tmp_path}/rollout --model pendulum' in said


@pytest.mark.graph
def test_a_process_that_ends_without_its_file_is_said(tmp_path):
    with Processes(tmp_path) as processes:
        processes.start('helper', 'play', '--help')
        with pytest.raises(UserError, match=r'helper ended without .*missing; see .*helper\.log'):
            processes.wait_for(tmp_path / 'missing', 'helper')


@pytest.mark.graph
def test_a_failing_command_ends_everything(tmp_path):
    processes = Processes(tmp_path)
    with pytest.raises(UserError, match='leo play'):
        play_nothing(processes, tmp_path)
    pid = int((tmp_path / 'pid').read_text())
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def play_nothing(processes, folder) -> None:
    with processes:
        processes.node('robot', 'leo_sim', 'robot', robot='pendulum', realtime_factor=0)
        (folder / 'pid').write_text(str(processes._running['robot'].pid))
        processes.ask('play', str(folder / 'no_policy'))


@pytest.mark.graph
def test_the_secret_is_not_in_the_list_of_processes(tmp_path):
    secret = 471_147_114_711  # longer than any part of a time stamp that has it by chance
    hidden = {'hidden_seed': secret, 'sealed': str(tmp_path / 'sealed')}
    with Processes(tmp_path / 'logs') as processes:
        options = {'robot': 'pendulum', 'realtime_factor': 0, 'seed': 3}
        processes.node('robot', 'leo_sim', 'robot', **options, **hidden)
        files, seen = Path(f'/proc/{processes._running["robot"].pid}'), set()
        while not (tmp_path / 'sealed').exists():
            assert processes._running['robot'].poll() is None
            seen |= {(files / name).read_bytes() for name in ('cmdline', 'environ')}
            time.sleep(0.002)
        reset = 'service', 'call', '/robot/reset', 'std_srvs/srv/Trigger', '--timeout', '60'
        processes.ask(*reset)
        seen |= {(files / name).read_bytes() for name in ('cmdline', 'environ')}
    assert not any(b'hidden' in text or str(secret).encode() in text for text in seen)
    left = [path for path in tmp_path.rglob('*') if path.is_file() and path.name != 'sealed']
    assert not any(str(secret) in path.read_text() for path in left)
    (effect,) = read_sealed(tmp_path / 'sealed')['effects']
    robot = load_robot('pendulum')
    assert effect['name'] == draw(robot, np.random.default_rng(secret)).effect.name


def test_the_quick_one_finds_the_secret_and_writes_nothing_over(tmp_path, capsys):
    words = ['demo', '--quick', '-o', str(tmp_path / 'out')]
    main([*words, '--json'])
    answer, truth = map(json.loads, capsys.readouterr().out.split('\n', 1))
    assert truth == read_sealed(SHIPPED / 'secret.seal')
    (secret,), (found, *_) = truth['effects'], answer['effects']
    known = {found['name'], *(other['name'] for other in found['confusable_with'])}
    assert secret['name'] in known
    assert (tmp_path / 'out/report.html').is_file()
    assert main(words) == 2
    assert 'exists' in capsys.readouterr().err
