# SPDX-License-Identifier: Apache-2.0
"""Files and folders that no format reads, and what to do with them instead."""

from __future__ import annotations

from pathlib import Path

from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo

BAGS = ('.mcap', '.db3')
SHEETS = ('.xlsx', '.xls', '.xlsm', '.xlsb', '.ods', '.numbers')


def refuse_unread(log: Path) -> None:
    """Refuse a log that is not there, a bag, a spreadsheet, and a folder of something else."""
    if not log.exists():
        raise UserError(f'no log {log}')
    if _is_bag(log):
        raise UserError(
            f'{log} is a bag already and needs no import; look into it: {leo("bag", "info", log)}'
        )
    if log.is_dir():
        raise UserError(
            f'{log} is a folder without meta/info.json, so no LeRobot data set; name files'
        )
    if log.suffix.lower() in SHEETS:
        raise UserError(f'{log} is a spreadsheet; save it as CSV and import that')


def _is_bag(log: Path) -> bool:
    files = log.iterdir() if log.is_dir() else [log]
    return any(file.suffix.lower() in BAGS for file in files)
