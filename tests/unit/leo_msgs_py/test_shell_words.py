# SPDX-License-Identifier: Apache-2.0
"""Commands that are printed mean in a shell what they say, whatever a folder is called."""

import subprocess

import pytest
from tests.hostile_names import SHELL

from leo_msgs_py.shell_words import leo

SHOW = 'leo() { printf "%s\\n" "$@"; }\n'


@pytest.mark.parametrize('name', [SHELL, 'two words', 'a\nb', "it's", '~', '*', '-o'])
def test_a_shell_takes_each_word_as_it_is(name, tmp_path):
    typed = SHOW + leo('bag', 'info', name)
    done = subprocess.run(['sh', '-c', typed], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout == f'bag\ninfo\n{name}\n'
    assert list(tmp_path.iterdir()) == []
