# SPDX-License-Identifier: Apache-2.0
"""The six parameter services every ROS node has, over a node's `Parameters`."""

from __future__ import annotations

from typing import Any

from leo_msgs_py import messages as m
from leo_msgs_py.node.parameters import (
    from_value_message,
    Parameter,
    parameter_type,
    Parameters,
    to_value_message,
)


class ParameterServices:
    """Answers parameter requests; private parameters do not exist here."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters

    def table(self) -> dict[str, tuple[Any, Any]]:
        """Service name -> (type, callback)."""
        return {
            'describe_parameters': (m.DescribeParameters, self.describe),
            'get_parameter_types': (m.GetParameterTypes, self.get_types),
            'get_parameters': (m.GetParameters, self.get),
            'list_parameters': (m.ListParameters, self.list),
            'set_parameters': (m.SetParameters, self.set),
            'set_parameters_atomically': (m.SetParametersAtomically, self.set_atomically),
        }

    def describe(self, request: Any, response: Any) -> Any:
        """Descriptors; empty ones for unknown names."""
        response.descriptors = [
            self._parameters.describe(name)
            if self._parameters.is_public(name)
            else m.ParameterDescriptor(name=name)
            for name in request.names
        ]
        return response

    def get_types(self, request: Any, response: Any) -> Any:
        """ParameterType numbers; 0 for unknown names."""
        response.types = [parameter_type(self._value(name)) for name in request.names]
        return response

    def get(self, request: Any, response: Any) -> Any:
        """Values; 'not set' for unknown names."""
        response.values = [to_value_message(self._value(name)) for name in request.names]
        return response

    def list(self, request: Any, response: Any) -> Any:
        """Names below the prefixes (all without any), at most so many dots deeper."""
        names = [name for name in self._parameters.public() if _listed(name, request)]
        response.result.names = names
        response.result.prefixes = sorted({n.rpartition('.')[0] for n in names if '.' in n})
        return response

    def set(self, request: Any, response: Any) -> Any:
        """Set one by one, each with its own result."""
        response.results = [
            self._parameters.set([parameter]) for parameter in _parameters(request)
        ]
        return response

    def set_atomically(self, request: Any, response: Any) -> Any:
        """Set all or none."""
        response.result = self._parameters.set(_parameters(request))
        return response

    def _value(self, name: str) -> Any:
        return self._parameters.get(name).value if self._parameters.is_public(name) else None


def _parameters(request: Any) -> list[Parameter]:
    return [Parameter(p.name, from_value_message(p.value)) for p in request.parameters]


def _listed(name: str, request: Any) -> bool:
    deepest = request.depth
    if not len(request.prefixes):
        return not deepest or name.count('.') < deepest
    for prefix in request.prefixes:
        if name == prefix:
            return True
        if name.startswith(f'{prefix}.'):
            deeper = name[len(prefix) :].count('.')
            if not deepest or deeper <= deepest:
                return True
    return False
