# SPDX-License-Identifier: Apache-2.0
"""CSV as people have it: other delimiters, decimal commas; refused where it may be either."""

import numpy as np
import pytest

from leo_diffmodel.bags.importing.csv_log import read_csv
from leo_diffmodel.bags.importing.log_format import LogFormat
from leo_msgs_py.errors import UserError

NUMBERS = [[0.0, 1.5], [0.25, -2.0], [0.5, 1e-3]]


@pytest.mark.parametrize(('text', 'said'), [
    ('t,q\n0,1.5\n0.25,-2\n0.5,1e-3\n', {}),
    ('t;q\n0;1.5\n0.25;-2\n0.5;0.001\n', {}),
    ('t;q\n0;1,5\n0,25;-2\n0,5;1e-3\n', {}),
    ('t\tq\r\n0\t1,5\r\n0,25\t-2\r\n0,5\t0,001\r\n', {}),
    ('t,q\n"0","1,5"\n"0,25","-2"\n"0,5","0,001"\n', {}),
    ('# t ; q\n\n0 ; 1,5\n 0,25 ; -2\n0,5;1,0E-3\n', {}),
    ('0,00;1,5\n0,25;-2,0\n0,50;0,001\n', {'header': ['t', 'q']}),
    ('t|q\n0|1.5\n0.25|-2\n0.5|0.001\n', {'delimiter': '|'}),
    ('t;q\n0;1,500\n0,250;-2,000\n0,500;0,001\n', {'decimal': ','}),
])  # fmt: skip
def test_any_delimiter_and_decimal_sign(tmp_path, text, said):
    log = tmp_path / 'log.csv'
    log.write_text(text)
    (table,) = read_csv(log, LogFormat(**said))
    assert list(table) == ['t', 'q']
    np.testing.assert_array_equal(np.column_stack([*table.values()]), NUMBERS)


@pytest.mark.parametrize(('text', 'said', 'message'), [
    ('t;q\n1;1,500\n2;2,250\n', {}, 'is 1,500 a thousand, or one and a bit'),
    ('t;q\n1;1,5\n2;2.5\n', {}, 'numbers like 1,5 and like 2.5; which is the decimal sign'),
    ('a;b,c;d\n1;2,3;4\n1;2,3;4\n', {}, "',' and ';' both part it into columns"),
    ('t;q\n1;1,5\n2;2,5\n', {'decimal': '.'}, "line 2, q: '1,5' is not a number"),
    ('t;q\n1;1,5\n2;2.5\n', {'decimal': ','}, "line 3, q: '2.5' is not a number"),
    ('t;q\n1;1.000,5\n2;2,5\n', {}, "'1.000,5' is not a number"),
    ('t;q\n1;1;1\n2;2,5\n', {}, 'line 2: 3 values, 2 columns'),
    ('t;q\n1;' + '9' * 10**6 + '\n', {}, 'field larger than field limit'),
])  # fmt: skip
def test_what_may_be_either_is_refused(tmp_path, text, said, message):
    log = tmp_path / 'log.csv'
    log.write_text(text)
    with pytest.raises(UserError, match=message) as refusal:
        read_csv(log, LogFormat(**said))
    assert '\n' not in str(refusal.value) and len(str(refusal.value)) < 500
