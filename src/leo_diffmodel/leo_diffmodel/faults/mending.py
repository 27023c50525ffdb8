# SPDX-License-Identifier: Apache-2.0
"""Undo faults by what a topic map can say: in memory, or as the lines of a map."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from leo_diffmodel.bags.mend import mended as by_map
from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.faults.base import Found

FACTORS = ('scale', 'speed_scale', 'input_scale', 'time_scale')


def map_of(faults: Sequence[Found], actuators: Sequence[str]) -> TopicMap:
    """The topic map that undoes faults; those that no map undoes are passed over.

    Args:
        faults: of one log.
        actuators: whose inputs are meant where a fault is of all inputs.
    """
    joints: dict[str, dict[str, Any]] = {}
    whole: dict[str, Any] = {}
    for fault in faults:
        everywhere = fault.fault.whole_log and fault.fault.channel == 'input'
        names = actuators if everywhere else [fault.joint]
        for name in names:
            merged = whole if not name else joints.setdefault(name, {})
            for key, value in fault.patch.items():
                merged[key] = merged.get(key, 1.0) * value if key in FACTORS else value
    return TopicMap.model_validate({**whole, 'joints': joints})


def mended(recording: Recording, faults: Sequence[Found]) -> Recording:
    """The recording without the faults that a topic map can undo."""
    patched = [f for f in faults if f.patch]
    return by_map(recording, map_of(patched, recording.actuators)) if patched else recording
