# SPDX-License-Identifier: Apache-2.0
"""leo completion: bash completes verbs, sub-verbs, options and robots."""

import subprocess

import pytest

from leo_msgs_py.cli import main


@pytest.fixture(scope='module')
def script(tmp_path_factory):
    path = tmp_path_factory.mktemp('completion') / 'leo.bash'
    with path.open('w') as file, pytest.MonkeyPatch.context() as patch:
        patch.setattr('sys.stdout', file)
        assert main(['completion', 'bash']) == 0
    return path


def completed(script, *words):
    line = f'COMP_WORDS=(leo {" ".join(words)}); COMP_CWORD={len(words)}'
    line = f'source {script}; {line}; _leo; echo "${{COMPREPLY[@]}}"'
    done = subprocess.run(['bash', '-c', line], capture_output=True, text=True, check=True)
    return done.stdout.split()


@pytest.mark.parametrize(
    ('words', 'expected'),
    [
        (('exp',), ['explain', 'export']),
        (('explain', 'bag', '--hold'), ['--hold-out']),
        (('robot', 'ini'), ['init']),
        (('robot', 'init', '--inp'), ['--input']),
        (('compare', 'bag', '--model', 'servo'), ['servo_pendulum']),
        (('completion', 'z'), ['zsh']),
    ],
)
def test_completed(script, words, expected):
    assert completed(script, *words) == expected


def test_zsh_reads_the_same_script(capsys):
    main(['completion', 'zsh'])
    assert 'bashcompinit' in capsys.readouterr().out.splitlines()[1]
