# SPDX-License-Identifier: Apache-2.0
"""Compiled functions that are kept on disk follow what they call into."""

import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

import leo_sim.common.compiled

INNER = """
from leo_sim.common.compiled import compiled_in_place

@compiled_in_place
def inner(x):
    return x + {}
"""
OUTER = """
from leo_sim.common.compiled import compiled
from leo_sim.inner import inner

@compiled
def outer(x):
    return inner(x)

print(outer(0), sum(outer.stats.cache_hits.values()))
"""


@pytest.mark.parametrize('folder', ['', 'kept'])
def test_a_function_is_compiled_again_when_one_it_calls_has_changed(tmp_path, folder):
    package = tmp_path / 'leo_sim'
    (package / 'common').mkdir(parents=True)
    shutil.copy(leo_sim.common.compiled.__file__, package / 'common')
    for folder_of in (package, package / 'common'):
        (folder_of / '__init__.py').touch()
    (package / 'outer.py').write_text(OUTER)
    said = []
    for added in (1, 1, 2):
        (package / 'inner.py').write_text(INNER.format(added))
        said.append(_run(tmp_path, folder))
    assert said == ['1 0', '1 1', '2 0']
    assert list((tmp_path / folder).rglob('outer*.nbi'))


def _run(root: Path, folder: str) -> str:
    given = {
        **os.environ,
        'PYTHONPATH': str(root),
        'PYTHONDONTWRITEBYTECODE': '1',
        'NUMBA_CACHE_DIR': str(root / folder) if folder else '',
    }
    code = 'import leo_sim.outer'
    how = {'env': given, 'cwd': root, 'check': True, 'capture_output': True, 'text': True}
    done = subprocess.run([sys.executable, '-c', code], timeout=120, **how)
    return done.stdout.strip()
