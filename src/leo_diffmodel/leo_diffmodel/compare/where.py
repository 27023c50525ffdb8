# SPDX-License-Identifier: Apache-2.0
"""Where a model fails: the missing torque by joint and condition, worst first."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.compare.conditions import BACKWARD, Condition, conditions, FORWARD
from leo_diffmodel.compare.settings import COMPARE
from leo_diffmodel.compare.sizes import in_volts, stall_torque, torque_unit
from leo_diffmodel.compare.torque import MissingTorque
from leo_diffmodel.compare.windows import Array
from leo_sim.description.robot import Robot
from leo_sim.model import Model


@dataclass(frozen=True)
class Where:
    """Shares of the missing torque's square beyond noise.

    Torques of different joints are compared in units of their joint's own noise, which is how far
    they move the joint. Single events (a push, a glitch) take no part.
    """

    joints: list[dict]
    """Rows {joint, share, torque_nm (on slides N, as torque_unit says), noise_nm, volts,
    stall_percent, mean_nm, mean_error_nm}."""
    rows: list[dict]
    noise_only: bool  # all of it is within four standard errors of what noise gives
    events: list[dict]  # rows {joint, torque_nm, window, bag} of single events, largest first


def where(missing: MissingTorque, model: Model) -> Where:
    """Share of the missing torque by joint, variable and bin.

    Worst first: by how much more than its part of the joint's time a bin has of the error.
    """
    single = single_events(missing)
    events = _events(missing, model.robot, single)
    missing = missing.take(np.flatnonzero(~single.any(axis=1)))
    excess = _excess(missing)
    total = max(float(excess.sum()), np.sqrt(excess.size))
    shown, always = np.flatnonzero(missing.seen.any(axis=0)), np.full(len(missing.time), True)
    joints = [_part(missing, model.robot, excess, total, int(j), always) for j in shown]
    rows = [
        _row(missing, model.robot, excess, total, condition)
        for condition in conditions(missing.windows, model, pressed=missing.carrying)
        if missing.seen[condition.inside, condition.joint].any()
    ]
    share = {row['joint']: row['share'] for row in joints}
    rows = [{**row, 'joint_share': share[row['joint']]} for row in rows]
    rows.sort(key=lambda r: r['data_share'] * r['joint_share'] - r['share'])
    return Where(joints, rows, noise_only(missing), events)


def single_events(missing: MissingTorque) -> Array:
    """Windows far above all others at a joint, where they are few, shape (W, J)."""
    size = np.abs(missing.torque)
    typical = np.maximum(_median(size, missing), _median(missing.spread, missing))
    far = size > COMPARE.event * typical
    few = far.sum(axis=0) <= max(COMPARE.few_events, COMPARE.few_events_share * len(size))
    return far & few


def _events(missing: MissingTorque, robot: Robot, single: Array) -> list[dict]:
    names, spans = robot.joint_names, missing.windows.spans
    found = [
        {
            'joint': names[j],
            'torque_nm': float(missing.torque[w, j]),
            'torque_unit': torque_unit(robot, names[j]),
            'window': spans[w].tolist(),
            'bag': int(missing.windows.source[w]),
        }
        for w, j in np.argwhere(single)
    ]
    return sorted(found, key=lambda e: -abs(e['torque_nm']))


def worst_places(rows: Sequence[dict]) -> list[dict]:
    """The worst bin of each joint and variable, where it stands out, and not by chance."""
    return [row for row in ranked(rows) if stands_out(row)]


def ranked(rows: Sequence[dict]) -> list[dict]:
    """The worst bin of each joint and variable; those that stand out come before the others."""
    first: dict[tuple[str, str], dict] = {}
    for row in sorted(rows, key=lambda r: not stands_out(r)):
        first.setdefault((row['joint'], row['variable']), row)
    return list(first.values())


def stands_out(row: dict) -> bool:
    """Whether a bin has more of the error than its part of the time, and not by chance."""
    even = row['data_share'] * row['joint_share']
    by_chance = row['share'] - even <= COMPARE.chance * row['share_error']
    return bool(not by_chance and row['share'] > even * COMPARE.marked)


def against_motion(rows: Sequence[dict]) -> list[tuple[str, float, float, str]]:
    """Joints whose mean missing torque differs with direction: name, forward, backward, unit."""
    by = {(r['joint'], r['bin']): r for r in rows if r['variable'] == 'direction'}
    found = []
    for (joint, word), row in by.items():
        other = by.get((joint, BACKWARD))
        if word != FORWARD or other is None:
            continue
        error = np.hypot(row['mean_error_nm'], other['mean_error_nm'])
        if abs(row['mean_nm'] - other['mean_nm']) > COMPARE.chance * error:
            found.append((joint, row['mean_nm'], other['mean_nm'], row['torque_unit']))
    return found


def bin_in_words(row: dict) -> str:
    """The bin of a row: `7.6 to 17 rad/s`, `forward`."""
    if isinstance(row['bin'], str):
        return row['bin']
    low, high = row['bin']
    return f'{low:.2g} to {high:.2g} {row["unit"]}'


def noise_only(missing: MissingTorque) -> bool:
    """Whether the torques are no larger than their own noise, at four standard errors."""
    square = ((missing.torque / missing.spread) ** 2)[missing.seen]
    if missing.carrying is not None:
        square = np.minimum(square, COMPARE.far)
    return bool(square.mean() < 1.0 + COMPARE.standard_errors * np.sqrt(2.0 / square.size))


def _excess(missing: MissingTorque) -> Array:
    """Squared torque beyond noise, in units of the joint's noise, shape (W, J).

    Typical noise; on the ground that of each window, since a joint swings in one and stands in
    the next.
    """
    spread = np.where(missing.seen, missing.spread, 0.0)
    typical = _median(missing.spread, missing)
    if missing.carrying is not None:
        typical = np.where(missing.seen, missing.spread, 1.0)
    return np.where(missing.seen, (missing.torque**2 - spread**2) / typical**2, 0.0)


def _median(values: Array, missing: MissingTorque) -> Array:
    """Of each joint, over the windows in which a torque could show there, shape (J,)."""
    shown = [column[seen] for column, seen in zip(values.T, missing.seen.T, strict=True)]
    return np.array([np.median(c) if c.size else 1.0 for c in shown])


def _row(missing: MissingTorque, robot: Robot, excess: Array, total: float, at: Condition) -> dict:
    j, inside = at.joint, at.inside
    windows = missing.windows
    largest = np.argsort(-np.abs(missing.torque[inside, j]))[: COMPARE.worst_windows]
    worst = np.flatnonzero(inside)[largest]
    scatter = float(np.sqrt(inside.sum()) * excess[inside, j].std()) / total
    return {
        **_part(missing, robot, excess, total, j, inside),
        'variable': at.variable,
        'bin': at.bin if isinstance(at.bin, str) else list(at.bin),
        'unit': at.unit,
        'bag': at.bag,
        'share_error': scatter,
        'data_share': float(inside.mean()),
        'windows': windows.spans[worst].tolist(),
        'bags': windows.source[worst].tolist(),
    }


def _part(
    missing: MissingTorque, robot: Robot, excess: Array, total: float, j: int, inside: Array
) -> dict:
    """Share, and size beyond noise in three units, of some windows at one joint.

    Windows count alike, or on the ground by their precision.
    """
    joint = robot.joint_names[j]
    inside = inside & missing.seen[:, j]
    torque, spread = missing.torque[inside, j], missing.spread[inside, j]
    weight = np.ones_like(spread) if missing.carrying is None else spread**-2.0
    weight = weight / weight.sum()
    typical = float(np.sqrt(max(float(weight @ (torque**2 - spread**2)), 0.0)))
    mean = float(weight @ torque)
    stall = stall_torque(robot, joint)
    return {
        'joint': joint,
        'share': min(max(0.0, float(excess[inside, j].sum()) / total), 1.0),
        'torque_nm': typical,
        'torque_unit': torque_unit(robot, joint),
        'noise_nm': float(np.sqrt(weight @ spread**2)),
        'volts': in_volts(robot, joint, typical),
        'stall_percent': None if not stall else 100 * typical / stall,
        'mean_nm': mean,
        'mean_error_nm': float(np.sqrt(weight**2 @ (torque - mean) ** 2)),
    }
