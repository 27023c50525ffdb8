# SPDX-License-Identifier: Apache-2.0
"""The command line in a report is one that can be typed again."""

import sys

import pytest
from tests.simulate import record, TORQUE

from leo_diffmodel.compare.known import provenance
from leo_sim.model import Model


@pytest.mark.parametrize(
    ('program', 'told'),
    [
        ('-c', 'leo'),
        ('/home/me/.venv/bin/leo', 'leo'),
        ('/src/leo_msgs_py/cli.py', 'leo'),
        ('mine.py', 'mine.py'),
    ],
)
def test_the_program_is_told_as_typed(monkeypatch, program, told):
    monkeypatch.setattr(sys, 'argv', [program, 'repair', 'my bag'])
    origin = provenance([record(TORQUE, seconds=1.0)], Model(TORQUE, engine='rigid'))
    assert origin['command'] == f"{told} repair 'my bag'"
