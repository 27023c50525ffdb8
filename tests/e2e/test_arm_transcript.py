# SPDX-License-Identifier: Apache-2.0
"""A teleoperated arm on its bus, from the cable to MuJoCo: each command follows from the last.

In seconds, too few for an answer; benchmarks/arm_transcript.py takes the minutes that one needs.
"""

import json
import re
import subprocess
import sys

import pytest
from tests.places import ROOT

pytest.importorskip('mujoco')
WALK = ['check-driver', 'import', 'import', 'explain', 'next', 'play', 'explain', 'export']
REFUSED = [*WALK[:5], 'export']
"""Of a log that is wrong, or an answer cut short, as on a busy machine: no run would help."""


def test_an_arm_goes_from_the_cable_to_mujoco(tmp_path):
    script = ROOT / 'benchmarks/arm_transcript.py'
    quick = ('--first-seed', '1', '--cases', '1', '--seconds', '10', '--within', '20s')
    done = subprocess.run(
        [sys.executable, script, *quick, '-o', tmp_path],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    said = (tmp_path / '1/transcript.txt').read_text()
    walk = re.findall(r'^\$ leo (\S+)', said, re.M)
    verbs = [verb for verb in walk if verb != 'add']
    refused = 'play' not in verbs
    assert verbs == (REFUSED if refused else WALK), said
    assert set(re.findall(r'^\[status (\d+)', said, re.M)) <= {'0', '1'}, said
    assert 'Traceback' not in said and 'Warning' not in said, said
    (row,) = map(json.loads, (tmp_path / 'transcript.jsonl').read_text().splitlines())
    last = 'first' if refused else 'both'
    assert not refused or row['first']['verdict'] in ('unknown', 'ambiguous'), said
    assert row[last]['verdict'] != 'none' and len(row['seconds']) == len(walk)
    assert ('add' in walk) == bool(row[last]['effects'])
    assert {'first', last, 'arm.xml'} <= {p.name for p in (tmp_path / '1').iterdir()}
    assert 'MuJoCo' in said.rpartition('$ leo export')[2], said
