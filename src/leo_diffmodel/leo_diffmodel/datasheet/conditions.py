# SPDX-License-Identifier: Apache-2.0
"""Supply and temperature of a motor while it was recorded."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from leo_diffmodel.bags.contents import BagContents, load
from leo_diffmodel.bags.states import deserialize
from leo_diffmodel.bags.types import SUPPLY, TEMPERATURE, Topic


def conditions(bags: Iterable[str], joint: str) -> list[dict[str, Any]]:
    """For each bag its name, `supply` [V] and `temperature` [degC]: first, last, least, most.

    What was not measured is left out.
    """
    return [_row(load(Path(bag)), joint) for bag in bags]


def _row(contents: BagContents, joint: str) -> dict[str, Any]:
    volts = list(_values(contents, SUPPLY, 'voltage', joint))
    degrees = list(_values(contents, TEMPERATURE, 'temperature', joint))
    row: dict[str, Any] = {'bag': contents.path.name}
    row |= {'supply': _span(volts, 'V')} if volts else {}
    return row | ({'temperature': _span(degrees, 'degC')} if degrees else {})


def _values(contents: BagContents, topic: Topic, field: str, joint: str) -> Iterator[float]:
    """What was measured of the motor at a joint; a frame without a name is of all motors."""
    logs = [log for log in contents.of_type(topic.type) if log.name.endswith(topic.name)]
    for log in logs:
        for _, message in deserialize(log, topic.type):
            value = float(getattr(message, field))
            if message.header.frame_id in ('', joint) and np.isfinite(value):
                yield value


def _span(values: list[float], unit: str) -> dict[str, Any]:
    span = {'first': values[0], 'last': values[-1], 'least': min(values), 'most': max(values)}
    return span | {'unit': unit}
