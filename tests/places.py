# SPDX-License-Identifier: Apache-2.0
"""Where things lie that tests read, however deep in the tree a test is."""

from pathlib import Path

TESTS = Path(__file__).resolve().parent
ROOT = TESTS.parent
REAL_DATA = ROOT.parent / 'shared/data'
"""Recordings of real robots, which are no part of the project and need not be there."""
DATA = TESTS / 'data'
RIG = TESTS / 'drivers/rig.py'  # A driver in a file of its own
