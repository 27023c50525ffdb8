# SPDX-License-Identifier: Apache-2.0
"""Undo faults of one log or several by what a topic map can say, in memory or as its lines."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
import math
from typing import Any

import numpy as np

from leo_diffmodel.bags.arrays import Run
from leo_diffmodel.bags.episode import kept, merged
from leo_diffmodel.bags.mend import mended as by_map
from leo_diffmodel.bags.recording import Recording, Recordings
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.faults.found import Found
from leo_diffmodel.faults.settings import LIMITS
from leo_diffmodel.outside.settings import OUTSIDE
from leo_msgs_py.errors import UserError
from leo_sim.drivers.base import INTERFACES

FACTORS = ('scale', 'speed_scale', 'input_scale', 'time_scale')


def map_of(faults: Sequence[Found]) -> TopicMap:
    """The topic map that undoes faults of one log; those that no map undoes are passed over."""
    joints: dict[str, dict[str, Any]] = {}
    whole: dict[str, Any] = {}
    for fault in faults:
        merged = joints.setdefault(fault.joint, {}) if fault.joint else whole
        for key, value in fault.patch.items():
            if key in FACTORS:
                value *= merged.get(key, 1.0)
            merged[key] = merged.get(key, {}) | value if isinstance(value, dict) else value
    return TopicMap.model_validate({**whole, 'joints': joints})


def mended(recording: Recording, faults: Sequence[Found]) -> Recording:
    """The recording without the faults that can be undone; UserError where nothing is left."""
    left = without(recording, [f for f in faults if f.cuts])
    if left is None:
        raise UserError(
            f'{recording.path}: no {OUTSIDE.least_piece} s in which all sensors measure'
        )
    return mapped(left, faults)


def mapped(recording: Recording, faults: Sequence[Found]) -> Recording:
    patched = [f for f in faults if f.patch]
    return by_map(recording, map_of(patched)) if patched else recording


def without(recording: Recording, found: Sequence[Found]) -> Recording | None:
    """The recording without the stretches of faults; None where nothing is left."""
    around = LIMITS.around
    spans = [(a - around, b + around) for f in found for a, b in f.where]
    if not spans:
        return recording
    return kept(recording, merged(spans, around), OUTSIDE.least_piece)


def unfiltered(recording: Recording, joint: str, tau: float) -> Recording:
    """A recording with the speed of one joint before its filter: the noise grows, not its sum."""
    j = recording.joints.index(joint)
    episodes = []
    for e in recording.episodes:
        dq = e.dq.copy()
        dq[:, j] += tau * np.gradient(dq[:, j], e.t)
        episodes.append(replace(e, dq=dq))
    return replace(recording, episodes=tuple(episodes))


def runs_of(recording: Recording) -> list[Run]:
    """Its episodes as what a bag is written from; speeds only where they were measured."""
    measured, sent = recording.rates == 'measured', INTERFACES.get(recording.input)
    runs = []
    for e in recording.episodes:
        inputs = {
            joint: {sent: e.inputs[:, a], 'enabled': e.enabled[:, a].astype(np.float64)}
            for a, joint in enumerate(recording.actuators)
            if sent
        }
        runs.append(Run(e.t, recording.joints, e.q, e.dq if measured else None, e.effort, inputs))
    return runs


def pooled(faults: Sequence[Found]) -> list[Found]:
    """One entry for each fault and joint, by all logs in which it is an error (or any)."""
    groups = groupby(sorted(faults, key=which), which)
    return sorted((_one(list(g)) for _, g in groups), key=lambda f: not f.error)


def all_mended(recordings: Recordings, faults: Sequence[Found]) -> list[Recording]:
    """Each recording without the errors that can be undone.

    What a log itself shows is mended in the logs that show it, with the value of all of them; what
    only torques show is mended in every log. Stretches are left out of their own log.
    """
    errors = pooled([f for f in faults if f.error and f.patch])
    out = []
    for r in recordings:
        own = [f for f in faults if f.bag == str(r.path) and f.error]
        shown = set(map(which, own))
        here = [f for f in errors if f.evidence == 'balance' or which(f) in shown]
        out.append(mended(r, [*(f for f in own if f.cuts), *here]))
    return out


def which(f: Found) -> tuple[str, ...]:
    """What a fault is, and of which joints."""
    return f.code, f.joint, *f.names


def _one(group: Sequence[Found]) -> Found:
    """The mean of a fault's estimates, weighted by how sure they are."""
    sure = [f for f in group if f.error] or [*group]
    spread = np.array([max(np.hypot(f.sd, f.worst), 1e-12) for f in sure])
    weight = spread**-2 / (spread**-2).sum()
    first = sure[int(np.argmin(spread))]
    apart = [math.remainder(f.value - first.value, first.fault.turn) for f in sure]
    value = first.value + float(weight @ apart)
    bags = len({f.bag for f in sure})
    others = 'log' if bags == 2 else 'logs'
    more = f' (and in {bags - 1} other {others})' if bags > 1 else ''
    sd = float((spread**-2).sum() ** -0.5) if bags > 1 else first.sd
    return replace(first, value=value, sd=sd, what=first.what + more)
