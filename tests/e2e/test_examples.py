# SPDX-License-Identifier: Apache-2.0
"""The scripts and the notebook in examples/ run as they are and find what was hidden."""

from pathlib import Path
import re
import subprocess
import sys

from nbclient import NotebookClient
import nbformat
import pytest
from tests.places import ROOT

from leo_sim.model.model_file import load_model

EXAMPLES = ROOT / 'examples'
ROBOT = 'torque_pendulum'


def run(folder: Path, script: str, *words: str) -> str:
    command = [sys.executable, str(EXAMPLES / script), *words]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope='module')
def bags(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp('examples')
    for seed, name in enumerate(('friction', 'other'), start=1):
        run(folder, 'record.py', name, 'coulomb_friction:pivot', 'c=0.2', '--seed', str(seed))
    run(folder, 'record.py', 'hose', f'{EXAMPLES}/own_effect.py:pivot', 'k=0.3', 'slack=0.4')
    return folder


def test_read(bags):
    said = run(bags, 'read.py', 'friction', ROBOT)
    assert '10.0 s, 100 states a second' in said and 'pivot: torque rms' in said


def test_compare(bags):
    assert 'worst at pivot, direction' in run(bags, 'compare.py', 'friction', ROBOT)


def test_explain_and_add(bags):
    said = run(bags, 'explain.py', 'friction', 'other', ROBOT, 'repaired.yaml')
    assert said.startswith('named: Missing: coulomb_friction:pivot')
    (placed,) = load_model(bags / 'repaired.yaml').effects
    low, high = placed.ci95['c']
    assert low < 0.2 < high
    before, after = re.search(r'0\.50 s ahead on other: (\S+) -> (\S+) ', said).groups()
    assert float(after) < 0.3 * float(before)


def test_own_effect(bags):
    assert run(bags, 'own_effect.py', 'hose', ROBOT).startswith('named: Missing: hose:pivot')


def test_first_look_notebook(tmp_path):
    notebook = nbformat.read(EXAMPLES / 'first_look.ipynb', as_version=4)
    assert not any(cell.get('outputs') for cell in notebook.cells)
    notebook.cells[1].source += f'\nfolder = Path({str(tmp_path)!r})'
    NotebookClient(notebook, timeout=600, kernel_name='python3').execute(cwd=tmp_path)
    outputs = [out for cell in notebook.cells for out in cell.get('outputs', ())]
    said = ''.join(out.text for out in outputs if out.output_type == 'stream')
    told = r'coulomb_friction at pivot: c = (\S+) N m \(95 %: (\S+) to (\S+)\)'
    found, low, high = map(float, re.search(told, said).groups())
    assert low < 0.2 < high and abs(found - 0.2) < 0.01
    before, after = map(float, re.search(r'0\.50 s ahead: (\S+) -> (\S+) rad', said).groups())
    assert after < 0.3 * before
    assert any('image/png' in out.get('data', {}) for out in outputs)


def test_every_example_is_run_here():
    tested = set(re.findall(r"'(\w+\.(?:py|ipynb))'", Path(__file__).read_text()))
    assert {p.name for p in EXAMPLES.iterdir() if p.suffix in ('.py', '.ipynb')} <= tested
