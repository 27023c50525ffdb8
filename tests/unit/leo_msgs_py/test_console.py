# SPDX-License-Identifier: Apache-2.0
"""Tables fold what is too wide; they cut nothing."""

import io

from leo_msgs_py.console import progress, Table, Terminal
from leo_msgs_py.terminal import visible_output

NAMES = ('command_delay', 'load_dependent_friction:shoulder_lift')


def test_names_are_never_cut_at_80_columns():
    table = Table('effect', title='effects')
    for column in ('found from', 'named from', 'unit', 'size', 'seconds', 'most like'):
        table.add_column(column, justify='right')
    for name in NAMES:
        table.add_row(name, '0.0123', '0.0456', 'N m s2/rad2', '0.1', '120', f'{NAMES[1]} (9.9)')
    text = io.StringIO()
    Terminal(file=text, width=80).print(table)
    lines = text.getvalue().splitlines()
    assert '…' not in text.getvalue() and max(map(len, lines)) <= 80
    first = ''.join(line.split('│')[1].strip() for line in lines if line.startswith('│'))
    assert all(name in first for name in NAMES)


def test_a_bar_draws_itself_and_no_name_in_it_is_obeyed(monkeypatch):
    text = io.StringIO()
    text.isatty = lambda: True
    monkeypatch.setattr('sys.stderr', text)
    monkeypatch.setenv('TERM', 'xterm')
    with visible_output(), progress('explaining', 2) as told:
        told('drag\x1b[2J')
    shown = text.getvalue()
    assert '\x1b[2K' in shown and r'\x1b[2K' not in shown
    assert 'explaining: drag' in shown and 'drag\x1b[2J' not in shown
