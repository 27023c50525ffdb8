# SPDX-License-Identifier: Apache-2.0
"""Arithmetic over the columns of a log, as `duty * supply` (no Python gets executed)."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
import operator
from typing import Any

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
            value = _Evaluator(text, columns).visit(tree)
    except (SyntaxError, ValueError, OverflowError):
        raise UserError(f'expression {shown(text)} is not arithmetic') from None
    except (RecursionError, MemoryError):
        raise UserError(
            f'expression {shown(text)} is too long; build it up in several columns'
        ) from None
    length = len(next(iter(columns.values())))
    return np.array(np.broadcast_to(value, (length,)), dtype=float)


class _Evaluator(ast.NodeVisitor):
    """Computes a tree of the few allowed nodes, refuses every other one.

    All values are arrays, (1,) or (T,), so that NumPy's rules hold for all of them: 0 / 0 is NaN.
    """

    def __init__(self, text: str, columns: Mapping[str, Column]) -> None:
        self._text = shown(text)
        self._names = {**CONSTANTS, **columns}

    def generic_visit(self, node: ast.AST) -> Any:
        raise UserError(
            f'expression {self._text}: {type(node).__name__} is not allowed; use numbers, '
            f'columns, + - * / % **, comparisons and {", ".join(FUNCTIONS)}'
        )

    def visit_Constant(self, node: ast.Constant) -> Any:
        if isinstance(node.value, int | float):
            return np.array([float(node.value)])
        return self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> Any:
        if node.id not in self._names:
            raise UserError(
                f'expression {self._text}: no column {node.id!r}{nearest(node.id, self._names)}'
            )
        return self._names[node.id]

    def visit_Attribute(self, node: ast.Attribute) -> Any:
        return self.visit_Name(ast.Name(ast.unparse(node)))  # a column named as action.elbow

    def visit_Subscript(self, node: ast.Subscript) -> Any:
        return self.visit_Name(ast.Name(canonical_index(ast.unparse(node))))  # data[:, 2]

    def visit_UnaryOp(self, node: ast.UnaryOp) -> Any:
        return self._operator(node.op)(1.0 * self.visit(node.operand))

    def visit_BinOp(self, node: ast.BinOp) -> Any:
        left, right = self.visit(node.left), self.visit(node.right)
        return self._operator(node.op)(1.0 * left, 1.0 * right)

    def visit_Compare(self, node: ast.Compare) -> Any:
        if len(node.ops) != 1:
            return self.generic_visit(node)
        left, right = self.visit(node.left), self.visit(node.comparators[0])
        return self._operator(node.ops[0])(left, right)

    def visit_Call(self, node: ast.Call) -> Any:
        if not isinstance(node.func, ast.Name) or node.func.id not in FUNCTIONS or node.keywords:
            return self.generic_visit(node)
        function, takes = FUNCTIONS[node.func.id]
        if len(node.args) != takes:
            raise UserError(
                f'expression {self._text}: {node.func.id} takes {takes} arguments, '
                f'found {len(node.args)}'
            )
        return function(*(1.0 * self.visit(argument) for argument in node.args))

    def _operator(self, node: ast.AST) -> Callable[..., Any]:
        return _OPERATORS.get(type(node)) or self.generic_visit(node)
