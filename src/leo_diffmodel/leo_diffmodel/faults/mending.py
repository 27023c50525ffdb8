# SPDX-License-Identifier: Apache-2.0
"""Undo faults by what a topic map can say: in memory, or as the lines of a map."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from leo_diffmodel.bags.arrays import Run
from leo_diffmodel.bags.episode import kept, merged
from leo_diffmodel.bags.mend import mended as by_map
from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.faults.base import Found
from leo_msgs_py.errors import UserError
from leo_sim.drivers.base import INTERFACES

FACTORS = ('scale', 'speed_scale', 'input_scale', 'time_scale')
AROUND, SHORTEST = 0.05, 0.5
"""s: left out about a stretch without measurements; the shortest piece that is kept."""


def map_of(faults: Sequence[Found]) -> TopicMap:
    """The topic map that undoes faults of one log; those that no map undoes are passed over."""
    joints: dict[str, dict[str, Any]] = {}
    whole: dict[str, Any] = {}
    for fault in faults:
        merged = joints.setdefault(fault.joint, {}) if fault.joint else whole
        for key, value in fault.patch.items():
            merged[key] = merged.get(key, 1.0) * value if key in FACTORS else value
    return TopicMap.model_validate({**whole, 'joints': joints})


def mended(recording: Recording, faults: Sequence[Found]) -> Recording:
    """The recording without the faults that can be undone.

    Raises:
        UserError: nothing is left.
    """
    left = without(recording, [f for f in faults if f.cuts])
    if left is None:
        raise UserError(f'{recording.path}: no {SHORTEST} s in which all sensors measure')
    return mapped(left, faults)


def mapped(recording: Recording, faults: Sequence[Found]) -> Recording:
    """The recording without the faults that a topic map can undo."""
    patched = [f for f in faults if f.patch]
    return by_map(recording, map_of(patched)) if patched else recording


def without(recording: Recording, found: Sequence[Found]) -> Recording | None:
    """The recording without the stretches of faults; None where nothing is left."""
    spans = sorted((a - AROUND, b + AROUND) for f in found for a, b in f.where)
    return kept(recording, [*merged(spans, AROUND)], SHORTEST) if spans else recording


def runs_of(recording: Recording) -> list[Run]:
    """Its episodes as what a bag is written from; speeds only where they were measured."""
    return [
        Run(
            e.t,
            recording.joints,
            e.q,
            e.dq if recording.rates == 'measured' else None,
            e.effort,
            {}
            if recording.input == 'none'
            else {
                joint: {
                    INTERFACES[recording.input]: e.inputs[:, a],
                    'enabled': e.enabled[:, a].astype(np.float64),
                }
                for a, joint in enumerate(recording.actuators)
            },
        )
        for e in recording.episodes
    ]
