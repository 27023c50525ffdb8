# SPDX-License-Identifier: Apache-2.0
"""The live page at the end of leo demo: where somebody can see it, and nowhere else."""

import sys
from types import SimpleNamespace

import pytest

from leo_diffmodel.verbs import watch, watch_common
from leo_learner.demo import main_job
from leo_learner.verbs.demo import main


@pytest.fixture
def opened(monkeypatch):
    words: list[list[str]] = []

    def serve(argv: list[str]) -> int:
        words.append(argv)
        raise KeyboardInterrupt

    job = SimpleNamespace(run=main_job.Found)
    monkeypatch.setattr(main_job, 'MainJob', lambda *_: job)
    monkeypatch.setattr(main_job, 'closing', lambda *_: None)
    monkeypatch.setattr(watch, 'main', serve)
    monkeypatch.setattr(watch_common, 'screen', lambda: True)
    monkeypatch.setattr(sys.stdout, 'isatty', lambda: True, raising=False)
    return words


def test_opens_the_page_on_its_recording_until_ctrl_c(opened, tmp_path):
    assert main(['-o', str(tmp_path / 'run')]) == 0
    run = tmp_path / 'run'
    assert opened == [[str(run / 'rollout'), '--model', 'pendulum', '-o', str(run / 'watch')]]


@pytest.mark.parametrize('option', ['--no-browser', '--json'])
def test_ends_without_a_page_where_it_is_told_to(option, opened, tmp_path):
    assert main([option, '-o', str(tmp_path / 'run')]) == 0 and not opened


@pytest.mark.parametrize('of', ['leo_diffmodel.verbs.watch_common.screen', 'sys.stdout.isatty'])
def test_ends_without_a_page_where_nobody_sees_it(of, opened, monkeypatch, tmp_path):
    monkeypatch.setattr(of, lambda: False, raising=False)
    assert main(['-o', str(tmp_path / 'run')]) == 0 and not opened
