# SPDX-License-Identifier: Apache-2.0
"""CSV as people have it: other delimiters, decimal commas; refused where it may be either."""

import numpy as np
import pytest

from leo_diffmodel.bags.importing.csv_log import read_csv
from leo_diffmodel.bags.importing.log_format import LogFormat
from leo_msgs_py.errors import UserError

NUMBERS = [[0.0, 1.5], [0.25, -2.0], [0.5, 1e-3]]


def table(folder, text, **said):
    (folder / 'log.csv').write_text(text, encoding='utf-8')
    (found,) = read_csv(folder / 'log.csv', LogFormat(**said))
    return found


@pytest.mark.parametrize(
    ('text', 'said', 'names'),
    [
        ('t,q\n0,1.5\n0.25,-2\n0.5,1e-3\n', {}, 'tq'),
        ('t;q\n0;1.5\n0.25;-2\n0.5;0.001\n', {}, 'tq'),
        ('t;q\n0;1,5\n0,25;-2\n0,5;1e-3\n', {}, 'tq'),
        ('t\tq\r\n0\t1,5\r\n0,25\t-2\r\n0,5\t0,001\r\n', {}, 'tq'),
        ('t,q\n"0","1,5"\n"0,25","-2"\n"0,5","0,001"\n', {}, 'tq'),
        ('# t ; q\n\n0 ; 1,5\n 0,25 ; -2\n0,5;1,0E-3\n', {}, 'tq'),
        ('0,00;1,5\n0,25;-2,0\n0,50;0,001\n', {'header': ['t', 'q']}, 'tq'),
        ('t|q\n0|1.5\n0.25|-2\n0.5|0.001\n', {'delimiter': '|'}, 'tq'),
        ('t;q\n0;1,500\n0,250;-2,000\n0,500;0,001\n', {'decimal': ','}, 'tq'),
        ('0,1.5\n0.25,-2\n0.5,1e-3\n', {}, '01'),
        ('0 1.5\n0.25   -2\n0.5\t1e-3\n', {}, '01'),
        ('# a run\n0;1,5\n0,25;-2,0\n0,5;1e-3\n', {}, '01'),
        ('0,1\n0,1.5\n0.25,-2\n0.5,1e-3\n', {}, '01'),
    ],
)
def test_any_delimiter_and_decimal_sign_and_no_header(tmp_path, text, said, names):
    found = table(tmp_path, text, **said)
    assert list(found) == [*names]
    np.testing.assert_array_equal(np.column_stack([*found.values()]), NUMBERS)


@pytest.mark.parametrize('second', ['00.250000', '00.25Z', '00.25+00:00', '00,25'])
@pytest.mark.parametrize('between', [' ', 'T'])
def test_dates_are_seconds(tmp_path, between, second):
    day = f'2026-10-25{between}02:00:'
    found = table(tmp_path, f't;q\n{day}00;1.5\n{day}{second};2\n')
    np.testing.assert_allclose(np.diff(found['t']), [0.25], atol=1e-6)


@pytest.mark.parametrize(
    ('text', 'said', 'message'),
    [
        ('t;q\n1;1,500\n2;2,250\n', {}, 'is 1,500 a thousand, or one and a bit'),
        ('t;q\n1;1,5\n2;2.5\n', {}, 'numbers like 1,5 and like 2.5; which is the decimal sign'),
        ('a;b,c;d\n1;2,3;4\n1;2,3;4\n', {}, "',' and ';' both part it into columns"),
        ('t;q\n1;1,5\n2;2,5\n', {'decimal': '.'}, "line 2, q: '1,5' is not a number"),
        ('t;q\n1;1,5\n2;2.5\n', {'decimal': ','}, "line 3, q: '2.5' is not a number"),
        ('t;q\n1;1.000,5\n2;2,5\n', {}, "'1.000,5' is not a number"),
        ('t;q\n1;1;1\n2;2,5\n', {}, 'line 2: 3 values, 2 columns'),
        ('# one\n# two\nt,q\n0,1\n# pause\n1,x\n', {}, "line 6, q: 'x' is not a number"),
        ('t;q\n1;' + '9' * 10**6 + '\n', {}, 'a line of 1000002 characters; at most 100000'),
    ],
)
def test_what_may_be_either_is_refused(tmp_path, text, said, message):
    with pytest.raises(UserError, match=message) as refusal:
        table(tmp_path, text, **said)
    assert '\n' not in str(refusal.value) and len(str(refusal.value)) < 500


@pytest.mark.parametrize(
    'above',
    [
        '# run 3 of 2026-11-25 12:30:15\n# mass = 0.5\n# Länge: 0,25 m\nt,q\n',
        '# mass = 0.5, Länge = 0.25\n# t,q\n',
        '// mass: 0.5\n// Länge = 25e-2 m\n// t,q\n',
        '% Länge=.25\n% mass=0.5\n\n% t , q\n',
    ],
)
def test_comments_above_the_header_and_their_constants(tmp_path, above):
    found = table(tmp_path, f'{above}0,1.5\n# a pause\n0.25,-2\n0.5,1e-3\n')
    assert {*found} == {'mass', 'Länge', 't', 'q'}
    assert found['mass'].tolist() == [0.5] * 3 and found['Länge'].tolist() == [0.25] * 3
    np.testing.assert_array_equal(np.column_stack([found['t'], found['q']]), NUMBERS)


def test_a_column_named_twice_is_refused_until_the_map_names_all(tmp_path):
    text = 't,q,tau,tau\n0,1,2,9\n1,1,2,9\n'
    with pytest.raises(UserError, match="'tau' is the name of columns 3 and 4; rename them, or"):
        table(tmp_path, text)
    found = table(tmp_path, text, header=['t', 'q', 'tau', 'tau2'])
    assert found['tau'].tolist() == [2, 2] and found['tau2'].tolist() == [9, 9]


@pytest.mark.parametrize('units', ['[s],[deg],-', 's,°,', '(s),(U/min),1'])
def test_a_line_of_units_below_the_header_is_part_of_the_names(tmp_path, units):
    found = table(tmp_path, f't,q,n\n{units}\n0,1,2\n1,3,4\n')
    second = units.split(',')[1].strip('()[]')
    assert list(found) == ['t [s]', f'q [{second}]', 'n'] and found['n'].tolist() == [2, 4]
