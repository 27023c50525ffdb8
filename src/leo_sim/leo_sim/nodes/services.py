# SPDX-License-Identifier: Apache-2.0
"""Answers of the robot's services."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from leo_sim.drivers.base import NotPossible, TransientFault


def answered(action: Callable[[], str], _request: Any, response: Any) -> Any:
    """Act, and fill a response with what was done or why it was not possible."""
    try:
        response.message, response.success = action(), True
    except (NotPossible, TransientFault) as error:
        response.message, response.success = str(error), False
    return response
