# SPDX-License-Identifier: Apache-2.0
"""Bags made from arrays: imported logs and simulated runs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from leo_msgs_py import cdr
from leo_msgs_py.errors import UserError

from .types import APPLIED, CURRENT, EPISODE, Floats, STATES, SUPPLY, TEMPERATURE, Topic
from .writer import BagWriter, whole_bag

EPISODE_PAUSE_NS = 1_000_000_000
LONGEST = 2.0**31  # what the seconds of a stamp can say [s]


@dataclass(frozen=True)
class Run:
    """One uninterrupted run of T samples and J joints; becomes one episode.

    Times [s] increase, their zero does not matter; positions [rad, m], velocities [rad/s, m/s] and
    measured torques [N m] have shape (T, J). `inputs` has for each actuated joint its interfaces,
    shape (T,): `voltage` [V], `effort` [N m] or `position` [rad] (NaN = not known), `enabled` (1
    or 0), `supply_voltage` [V], `current` [A], `temperature` [degC]; empty for a passive run.
    """

    t: Floats
    joints: Sequence[str]
    q: Floats
    dq: Floats | None = None
    effort: Floats | None = None
    inputs: Mapping[str, Mapping[str, Floats]] = field(default_factory=dict)


def write_runs(folder: Path, runs: Sequence[Run], metadata: Mapping[str, str]) -> Path:
    """Write runs to a new bag, one episode each, on one continuous clock that starts at 0."""
    with whole_bag(folder, metadata) as writer:
        _write(writer, runs)
    return folder


def _write(writer: BagWriter, runs: Sequence[Run]) -> None:
    start = 0
    for number, run in enumerate(runs, start=1):
        if start * 1e-9 + run.t[-1] - run.t[0] > LONGEST:
            raise UserError(f'the runs take more than {LONGEST:g} s; which unit is time in?')
        stamps = start + np.round((run.t - run.t[0]) * 1e9).astype(np.int64)
        for topic, stamp, data in _messages(run, number, stamps.tolist()):
            writer.write(writer.add_topic(*topic), data, stamp)
        start = int(stamps[-1]) + EPISODE_PAUSE_NS


def _messages(run: Run, number: int, stamps: list[int]) -> Iterator[tuple[Topic, int, bytes]]:
    yield EPISODE, stamps[0], cdr.uint32(number)
    columns = list(_columns(run))
    for k, stamp in enumerate(stamps):
        dq, effort = (() if values is None else values[k] for values in (run.dq, run.effort))
        yield STATES, stamp, cdr.joint_state(stamp, run.joints, run.q[k], dq, effort)
        for topic, joints, rows in columns:
            field = 'position' if topic is APPLIED['position'] else 'effort'
            yield topic, stamp, cdr.joint_state(stamp, joints, **{field: rows[k]})
        for joint, interfaces in run.inputs.items():
            if 'supply_voltage' in interfaces:
                yield SUPPLY, stamp, cdr.supply(stamp, joint, interfaces['supply_voltage'][k])
            if 'temperature' in interfaces:
                degrees = interfaces['temperature'][k]
                yield TEMPERATURE, stamp, cdr.temperature(stamp, joint, degrees)


def _columns(run: Run) -> Iterator[tuple[Topic, list[str], Sequence[Floats]]]:
    for interface, topic in {**APPLIED, 'current': CURRENT}.items():
        driven = {j: columns for j, columns in run.inputs.items() if interface in columns}
        if driven:
            values = np.column_stack([columns[interface] for columns in driven.values()])
            rows = list(values) if topic is CURRENT else _applied(values, driven)
            yield topic, list(driven), rows


def _applied(values: Floats, driven: Mapping[str, Mapping[str, Floats]]) -> list[Floats]:
    """Return the values with NaN where a motor is free, nothing where one is not known."""
    on = np.ones(len(values))
    free = np.column_stack([columns.get('enabled', on) for columns in driven.values()]) <= 0.5
    sent = np.where(free, np.nan, values)
    unknown = np.any(~free & ~np.isfinite(values), axis=1)
    return [row[:0] if unknown[k] else row for k, row in enumerate(sent)]
