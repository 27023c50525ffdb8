# SPDX-License-Identifier: Apache-2.0
"""Arithmetic over the columns of a log, as `duty * supply` (no Python gets executed)."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
import operator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leo_msgs_py.errors import UserError

from ..yaml_config import nearest

Column = NDArray[np.float64]

_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
    ast.Div: operator.truediv, ast.Mod: operator.mod, ast.Pow: np.float_power,
    ast.USub: operator.neg, ast.UAdd: operator.pos,
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
    ast.Eq: operator.eq, ast.NotEq: operator.ne,
}
FUNCTIONS: dict[str, Callable[..., Any]] = {
    'abs': np.abs, 'sign': np.sign, 'sqrt': np.sqrt, 'exp': np.exp, 'log': np.log,
    'sin': np.sin, 'cos': np.cos, 'tan': np.tan, 'atan2': np.arctan2,
    'min': np.minimum, 'max': np.maximum, 'clip': np.clip, 'where': np.where,
    'unwrap': np.unwrap, 'radians': np.radians,
}
CONSTANTS = {'pi': np.pi, 'nan': np.nan}


def evaluate(text: str, columns: Mapping[str, Column]) -> Column:
    """Return the value of an expression, shape (T,).

    Args:
        text: numbers, column names, pi, nan, + - * / % **, comparisons and `FUNCTIONS`.
        columns: each of shape (T,).

    Raises:
        UserError: not such an expression, or a name that is no column (naming the nearest).
    """
    try:
        tree = ast.parse(text.strip(), mode='eval').body
    except (SyntaxError, ValueError):
        raise UserError(f'expression {text!r} is not arithmetic') from None
    with np.errstate(all='ignore'):
        value = _Evaluator(text, columns).visit(tree)
    length = len(next(iter(columns.values())))
    return np.array(np.broadcast_to(np.asarray(value, dtype=float), (length,)))


class _Evaluator(ast.NodeVisitor):
    """Computes a tree of the few allowed nodes, refuses every other one."""

    def __init__(self, text: str, columns: Mapping[str, Column]) -> None:
        self._text = text
        self._names = {**CONSTANTS, **columns}

    def generic_visit(self, node: ast.AST) -> Any:
        raise UserError(
            f'expression {self._text!r}: {type(node).__name__} is not allowed; use numbers, '
            f'columns, + - * / % **, comparisons and {", ".join(FUNCTIONS)}'
        )

    def visit_Constant(self, node: ast.Constant) -> Any:
        if isinstance(node.value, int | float):
            return float(node.value)
        return self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> Any:
        if node.id not in self._names:
            raise UserError(
                f'expression {self._text!r}: no column {node.id!r}'
                f'{nearest(node.id, list(self._names))}'
            )
        return self._names[node.id]

    def visit_UnaryOp(self, node: ast.UnaryOp) -> Any:
        return self._operator(node.op)(self.visit(node.operand))

    def visit_BinOp(self, node: ast.BinOp) -> Any:
        return self._operator(node.op)(self.visit(node.left), self.visit(node.right))

    def visit_Compare(self, node: ast.Compare) -> Any:
        if len(node.ops) != 1:
            return self.generic_visit(node)
        left, right = self.visit(node.left), self.visit(node.comparators[0])
        return self._operator(node.ops[0])(left, right)

    def visit_Call(self, node: ast.Call) -> Any:
        if not isinstance(node.func, ast.Name) or node.func.id not in FUNCTIONS or node.keywords:
            return self.generic_visit(node)
        try:
            return FUNCTIONS[node.func.id](*(self.visit(argument) for argument in node.args))
        except (TypeError, ValueError):
            raise UserError(
                f'expression {self._text!r}: wrong arguments for {node.func.id}'
            ) from None

    def _operator(self, node: ast.AST) -> Callable[..., Any]:
        found = _OPERATORS.get(type(node))
        return found if found is not None else self.generic_visit(node)
