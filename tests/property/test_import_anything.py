# SPDX-License-Identifier: Apache-2.0
"""Whatever log, map or expression `leo import` is given: a bag, or one line and nothing else."""

from collections.abc import Callable
import json
from pathlib import Path
import tempfile
from typing import Any
import warnings

from hypothesis import example, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
import yaml

from leo_diffmodel.bags.importing.convert import import_logs, load_map
from leo_diffmodel.bags.importing.expression import evaluate, FUNCTIONS
from leo_diffmodel.bags.importing.guess import guess_map
from leo_diffmodel.bags.importing.tables import READERS
from leo_diffmodel.bags.recording import read_bag
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot

PENDULUM = load_robot('pendulum')
MAP: dict[str, Any] = {
    'time': 't',
    'joints': {'pivot': {'position': 'q', 'velocity': 'dq'}},
    'inputs': {'pivot': {'voltage': 'u'}},
}
COLUMNS = ('t', 'q', 'dq', 'u')
CELLS = (
    *('0', '1', '-1', '2.5', '1e300', '-1e300', '1e-320', 'nan', 'inf', '-inf', '4e9', '9e18'),
    *('1_0', '0x10', '١', '1 2', '1,2', '"1"', '', ' ', 'true', 'x', 'é'),
    *('"', "'", '\x00', '\x1b[31m', '-', '.'),
    *('9' * 400, '9' * 200_000),
)
JSON_CELLS = (
    *(None, True, 0, 1, -1, 2.5, 1e300, 4e9, 9e18, float('nan'), float('inf'), 10**400, 10**30),
    *('', 'x', '1', [], {}, [1.0], [[1.0], [2.0, 3.0]], {'q': 1}),
)
ENDS = ('\n', '\r\n', '\n\n', '\r', '\n \n')
PLACES = (
    *(None, '', 'a', 'a[0]', 'a[9]', 'a.b', '[*]', 'a[-1]', 'a[999999999]', 'a[:, 0]', 'a[0, :]'),
    *(['a', 'b'], ['a', 'a'], []),
)
FIELDS: tuple[dict[str, Any], ...] = (
    {},
    {name: name for name in COLUMNS},
    {name: f'[*].{name}' for name in COLUMNS},
    {name: ['a[*]', name] for name in COLUMNS},
    {'t': '[*][*]'},
    {name: f'a[:, {k}]' for k, name in enumerate(COLUMNS)},
)
SETTINGS = settings(max_examples=150, deadline=None)


def told(read: Callable[[], Any]) -> Any:
    """What it returns; None where it says what is wrong."""
    said = 'nothing wrong'
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        try:
            return read()
        except UserError as error:
            said = str(error)
    assert 0 < len(said) < 3000, said[:3000]
    return None


def imported(content: bytes, name: str, column_map: Any = None) -> None:
    """Import a log; what becomes a bag must also read, what does not leaves nothing."""
    with tempfile.TemporaryDirectory() as folder:
        log, mapping, bag = (Path(folder, each) for each in (name, 'map.yaml', 'bag'))
        log.write_bytes(content)
        mapping.write_text(yaml.safe_dump(MAP if column_map is None else column_map))
        if told(lambda: import_logs([log], mapping, bag)) is None:
            assert not bag.exists()
        else:
            told(lambda: read_bag(bag, PENDULUM))


def guessed(content: bytes, name: str) -> None:
    """Guess a map: one line, or a map that is one but for what is left to be filled in."""
    with tempfile.TemporaryDirectory() as folder:
        log, mapping = Path(folder, name), Path(folder, 'map.yaml')
        log.write_bytes(content)
        if told(lambda: guess_map(log, mapping)) is not None:
            assert 'time' in yaml.safe_load(mapping.read_text())
            told(lambda: load_map(mapping))
            imported(content, name, yaml.safe_load(mapping.read_text()))


rising = st.builds(
    lambda rows: [[0.01 * k, *row] for k, row in enumerate(rows)],
    st.lists(st.tuples(*[st.sampled_from(CELLS)] * 3), max_size=4),
)
lines = st.lists(
    st.one_of(
        st.just([]),
        st.lists(st.sampled_from(CELLS), max_size=6),
        st.tuples(*[st.sampled_from(CELLS)] * 4),
    ),
    max_size=6,
)


@SETTINGS
@given(
    st.one_of(st.just(list(COLUMNS)), st.lists(st.sampled_from((*COLUMNS, '', '1')))),
    st.one_of(lines, rising),
    st.sampled_from(ENDS),
    st.sampled_from(',;\t'),
)
@example([], [[], [], []], '\n', ',')
@example(list(COLUMNS), [[], []], '\n', ',')
@example(list(COLUMNS), [['9' * 200_000, '1', '1', '1']] * 2, '\n', ',')
@example(list(COLUMNS), [['0,1', '1', '1', '1'], ['0,2', '1', '1', '1']], '\n', ';')
def test_any_table(header, rows, end, sign):
    text = end.join(sign.join(map(str, row)) for row in [header, *rows])
    imported(text.encode(), 'log.csv')
    guessed(text.encode(), 'log.csv')
    guessed(f'# mass = 0.5 kg\n# {text}'.encode('utf-16'), 'log.csv')


@SETTINGS
@given(
    st.one_of(st.binary(max_size=200), st.text(max_size=200).map(str.encode)),
    st.sampled_from(['csv.gz', *(ending for reader in READERS for ending in reader.endings)]),
)
def test_any_bytes(content, kind):
    imported(content, f'log.{kind}')


cells = st.sampled_from(JSON_CELLS)
records = st.lists(st.one_of(cells, st.dictionaries(st.sampled_from(COLUMNS), cells)), max_size=4)
columns = st.dictionaries(st.sampled_from(COLUMNS), st.one_of(cells, st.lists(cells, max_size=4)))
rows = st.lists(st.lists(cells, max_size=4), max_size=4)
whole = st.builds(
    lambda rows: [dict(zip(COLUMNS, row, strict=True)) for row in rows],
    st.lists(st.tuples(cells, cells, cells, cells), max_size=4),
)


@SETTINGS
@given(
    st.one_of(
        *(records, columns, whole, rows, cells, st.fixed_dictionaries({'a': records})),
        st.fixed_dictionaries({'a': rows, 'b': rows}),
    ),
    st.sampled_from(PLACES),
    st.sampled_from(FIELDS),
)
def test_any_json(content, place, fields):
    guessed(json.dumps(content).encode(), 'log.json')
    imported(json.dumps(content).encode(), 'log.json', MAP | {'records': place, 'fields': fields})


@pytest.mark.parametrize(
    'text',
    [
        *('[' * 100_000, '[' * 100_000 + ']' * 100_000, '{"t":' * 100_000, '9' * 1_000_000),
        *('[{"t": ' + '9' * 5000 + '}]', '[{"t": ' + '9' * 400 + ', "q": 1}]'),
    ],
)
def test_deep_and_long_json(text):
    imported(text.encode(), 'log.json')


def test_a_row_of_a_million_digits():
    imported(b't,q,dq,u\n' + b'1' * 1_000_000 + b',0,0,0\n2,0,0,0\n', 'log.csv')


@pytest.mark.parametrize('start', [0.0, -1e9, 1e300, -1e300, 1.7e9])
@pytest.mark.parametrize('step', [1e-320, 1e-12, 0.01, 1e9, 4e9, 1e18, 1e300])
def test_any_time(start, step):
    rows = ''.join(f'{start + k * step!r},{0.1 * k},0,0\n' for k in range(4))
    imported(f't,q,dq,u\n{rows}'.encode(), 'log.csv')


@pytest.mark.parametrize(
    'changed',
    [
        *({'delimiter': sign} for sign in ('', ';;', '\n', '\x00')),
        *({'header': names} for names in ([], ['t', 't', 't', 't'], ['', 'q', 'dq', 'u'])),
        *({'time': {'period': seconds}} for seconds in (1e-320, 1e300, 5e8)),
        {'time': {'column': 't', 'unit': 'm'}},
        *({'columns': {'': 'q'}}, {'columns': {'q': 'q' * 9}}),
        {'joints': {'': {'position': 'q'}}},
        {'joints': {'pivot\n': {'position': 'q'}}, 'inputs': {}},
        {'joints': {'pivot': {'position': {'column': 'q', 'scale': 1e308, 'unit': 'deg'}}}},
        {'joints': {'pivot': {'position': {'expression': '(' * 300 + 'q' + ')' * 300}}}},
        *({'format': 'mat'}, {'format': 'json'}, {'fields': {'t': ''}}),
    ],
)
def test_any_map(changed):
    imported(b't,q,dq,u\n0,0.1,0,1e308\n0.01,0.2,0,1\n0.02,0.3,1,1\n', 'log.csv', MAP | changed)


numbers = st.sampled_from(('0', '1', '2.5', '1e308', '9' * 400, '1e999', 'pi', 'nan', 'q', 'n'))
expressions = st.recursive(
    numbers,
    lambda inner: st.one_of(
        st.builds(
            '({} {} {})'.format,
            inner,
            st.sampled_from(('+', '-', '*', '/', '%', '**', '<', '==', '//', '@')),
            inner,
        ),
        st.builds('{}{}'.format, st.sampled_from(('-', '+', '~', 'not ')), inner),
        st.builds(
            lambda name, given: f'{name}({", ".join(given)})',
            st.sampled_from(list(FUNCTIONS)),
            st.lists(inner, max_size=4),
        ),
    ),
    max_leaves=8,
)


def evaluated(text: str) -> None:
    """It has a value for every row, or one line says why not; what it reads stays as it is."""
    q, n = np.array([1.0, -2.0, np.nan]), np.array([0.0, 3.0, 1.0])
    before = q.copy(), n.copy()
    value = told(lambda: evaluate(text, {'q': q, 'n': n}))
    assert value is None or (value.shape == (3,) and value.dtype == float)
    assert value is None or not (np.shares_memory(value, q) or np.shares_memory(value, n))
    np.testing.assert_array_equal((q, n), before)


@settings(max_examples=600, deadline=None)
@given(expressions)
def test_any_expression(text):
    evaluated(text)


@settings(max_examples=600, deadline=None)
@given(st.text(alphabet='0123456789.eqn+-*/%()<>=,ab swhere\'"[]:\n\x00\\', max_size=30))
def test_any_text_as_expression(text):
    evaluated(text)


@pytest.mark.parametrize(
    'text',
    [
        *('+'.join(['q'] * 20_000), '-' * 100_000 + 'q', '(' * 10_000 + 'q' + ')' * 10_000),
        *('abs(' * 5_000 + 'q' + ')' * 5_000, '9' * 1_000_000, '**'.join(['q'] * 3_000)),
        *(' ' * 10**6 + 'q', '0/0*q', 'where(q)', 'abs(q, q)', 'max(q, n, q)', 'unwrap(1)'),
        *('1 % 0', 'q()', 'abs(*[q, q])'),
    ],
)
def test_long_and_deep_expressions(text):
    evaluated(text)
