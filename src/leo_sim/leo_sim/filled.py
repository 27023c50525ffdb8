# SPDX-License-Identifier: Apache-2.0
"""Broadcasting in the inner loop: NumPy's own functions cost more there than the copy."""
from typing import Any

import numpy as np


def filled(shape: tuple[int, ...], values: Any) -> Any:
    """A new array of that shape filled with values that broadcast to it."""
    result = np.empty(shape)
    result[...] = values
    return result


def paired(first: Any, second: Any) -> Any:
    """Both side by side along a new first axis of 2."""
    result = np.empty((2, *common(np.shape(first), np.shape(second))))
    result[0], result[1] = first, second
    return result


def common(*shapes: tuple[int, ...]) -> tuple[int, ...]:
    """The shape that all broadcast to."""
    distinct = {shape for shape in shapes if shape}
    if len(distinct) > 1:
        return np.broadcast_shapes(*distinct)
    return distinct.pop() if distinct else ()
