# SPDX-License-Identifier: Apache-2.0
"""Arithmetic over the columns of a log, as `duty * supply` (no Python gets executed)."""

import ast
from collections.abc import Callable, Mapping
from contextlib import suppress
import operator
from typing import Any, NoReturn

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.names import nearest
from leo_sim.common.yaml_file import shown

from .log_format import canonical_index, Column

_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Mod: operator.mod,
    ast.Pow: np.float_power,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
FUNCTIONS: dict[str, tuple[Callable[..., Any], int]] = {
    'abs': (np.abs, 1),
    'sign': (np.sign, 1),
    'sqrt': (np.sqrt, 1),
    'exp': (np.exp, 1),
    'log': (np.log, 1),
    'sin': (np.sin, 1),
    'cos': (np.cos, 1),
    'tan': (np.tan, 1),
    'atan2': (np.arctan2, 2),
    'min': (np.minimum, 2),
    'max': (np.maximum, 2),
    'clip': (np.clip, 3),
    'where': (np.where, 3),
    'unwrap': (np.unwrap, 1),
    'radians': (np.radians, 1),
}
"""Functions of columns, and how many of them each takes."""
CONSTANTS = {'pi': np.array([np.pi]), 'nan': np.array([np.nan])}


def evaluate(text: str, columns: Mapping[str, Column]) -> Column:
    """Return the value of an expression, shape (T,); what has no value is NaN or infinite.

    It may have numbers, column names, pi, nan, + - * / % **, comparisons and `FUNCTIONS`.
    """
    try:
        tree = ast.parse(text.strip(), mode='eval').body
        with np.errstate(all='ignore'):
            value = _value(tree, {**CONSTANTS, **columns}, shown(text))
    except (SyntaxError, ValueError, OverflowError):
        raise UserError(f'expression {shown(text)} is not arithmetic') from None
    except (RecursionError, MemoryError):
        raise UserError(
            f'expression {shown(text)} is too long; build it up in several columns'
        ) from None
    length = len(next(iter(columns.values())))
    return np.array(np.broadcast_to(value, (length,)), dtype=float)


def names_in(text: str) -> set[str]:
    """Return the columns that an expression names, and parts of their names."""
    with suppress(SyntaxError, ValueError, RecursionError, MemoryError):
        nodes = ast.walk(ast.parse(text.strip(), mode='eval'))
        kinds = ast.Name | ast.Attribute | ast.Subscript
        return {canonical_index(ast.unparse(node)) for node in nodes if isinstance(node, kinds)}
    return set()


def _value(node: ast.AST, names: Mapping[str, Column], text: str) -> Any:
    """Compute a tree of the few allowed nodes, refuse every other one.

    All values are arrays, (1,) or (T,), so that NumPy's rules hold for all of them: 0 / 0 is NaN.
    """

    def applied(sign: ast.AST, *operands: ast.AST) -> Any:
        values = [1.0 * _value(operand, names, text) for operand in operands]
        if type(sign) not in _OPERATORS:
            _refuse(sign, text)
        return _OPERATORS[type(sign)](*values)

    match node:
        case ast.Constant(value=int() | float() as number):
            return np.array([float(number)])
        case ast.Name() | ast.Attribute() | ast.Subscript():  # q, action.elbow, data[:, 2]
            return _column(canonical_index(ast.unparse(node)), names, text)
        case ast.UnaryOp():
            return applied(node.op, node.operand)
        case ast.BinOp():
            return applied(node.op, node.left, node.right)
        case ast.Compare(ops=[sign], comparators=[right]):
            return applied(sign, node.left, right)
        case ast.Call(func=ast.Name(id=name), keywords=[]) if name in FUNCTIONS:
            function, takes = FUNCTIONS[name]
            if len(node.args) != takes:
                raise UserError(
                    f'expression {text}: {name} takes {takes} arguments, found {len(node.args)}'
                )
            return function(*(1.0 * _value(argument, names, text) for argument in node.args))
    return _refuse(node, text)


def _column(name: str, names: Mapping[str, Column], text: str) -> Column:
    if name not in names:
        raise UserError(f'expression {text}: no column {name!r}{nearest(name, names)}')
    return names[name]


def _refuse(node: ast.AST, text: str) -> NoReturn:
    raise UserError(
        f'expression {text}: {type(node).__name__} is not allowed; use numbers, '
        f'columns, + - * / % **, comparisons and {", ".join(FUNCTIONS)}'
    )
