# SPDX-License-Identifier: Apache-2.0
"""What is no log is refused with what to do instead."""

import pytest

from leo_diffmodel.bags.importing.log_format import LogFormat
from leo_diffmodel.bags.importing.tables import reader_of
from leo_msgs_py.errors import UserError


@pytest.mark.parametrize(
    ('file', 'log', 'message'),
    [
        ('run.xlsx', 'run.xlsx', 'is a spreadsheet; save it as CSV and import that'),
        ('run.mcap', 'run.mcap', 'is a bag already and needs no import; look into it: leo bag'),
        ('run/run_0.mcap', 'run', 'is a bag already and needs no import; look into it: leo bag'),
        ('run/run_0.db3', 'run', 'is a bag already and needs no import; look into it: leo bag'),
        ('run/a.csv', 'run', 'is a folder without meta/info.json'),
        ('run/a.csv', 'other', 'no log'),
        ('run.dat', 'run.dat', "unknown format 'dat'"),
    ],
)
def test_what_is_no_log_is_told_what_to_do(tmp_path, file, log, message):
    (tmp_path / file).parent.mkdir(exist_ok=True)
    (tmp_path / file).touch()
    with pytest.raises(UserError) as refusal:
        reader_of(tmp_path / log, LogFormat())
    assert message in str(refusal.value) and '\n' not in str(refusal.value)
