# SPDX-License-Identifier: Apache-2.0
"""The impulses on a robot on the ground, solved together; for `contact_kernel`.

Sweeps over them (Moreau), each exact for its row, find what holds, sticks and slides, and a linear
solve in between brings all into agreement.
"""

from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array
from leo_sim.common.compiled import compiled_in_place
from leo_sim.dynamics import contact_work as row
from leo_sim.dynamics.contact_work import Work
from leo_sim.dynamics.impulses import slowed, too_fast

REDUNDANT = 1e-11  # share of a row's own answer that parts rows saying the same


@compiled_in_place
def share(h: float, work: Work, j: int) -> Any:
    """Rate of the motor side of joint j that a unit impulse causes."""
    return 1.0 / (work.joint[row.INERTIA, j] + 0.5 * h * work.joint[row.MOTOR_DRAG, j])


@compiled_in_place
def swept(h: float, grip: float, work: Work, used: int) -> Any:
    """Correct every impulse once; returns the largest change of a rate."""
    joint, line, moved = work.joint, work.line, 0.0
    for r in range(used):
        kind, j, answer, given = work.kind[r], work.place[r], work.gram[r, r], line[row.GIVEN, r]
        if kind == row.TANGENT:
            continue
        if kind == row.NORMAL:
            total, sideways = pressed(grip, work, r)
            moved = max(moved, changed(work, used, r + 1, sideways))
        elif kind == row.GAP:
            motor = share(h, work, j)
            slip = joint[row.SPEED, j] - line[row.RATE, r] + (motor + answer) * given
            fast = too_fast(slip, joint[row.OFFSET, j], joint[row.GAP_WIDTH, j], h)
            total = fast / (motor + answer)
            joint[row.SPEED, j] -= (total - given) * motor
        else:
            free = line[row.RATE, r] - answer * given
            if kind == row.FRICTION:
                kept = slowed(joint[row.BEFORE, j], free, joint[row.LEVEL, j] * h * answer)
            else:
                kept = min(
                    max(free, min(joint[row.LOW, j] - joint[row.Q, j], 0.0) / h),
                    max(joint[row.HIGH, j] - joint[row.Q, j], 0.0) / h,
                )
            total = (kept - free) / answer
        moved = max(moved, changed(work, used, r, total))
    return moved


@compiled_in_place
def changed(work: Work, used: int, r: int, total: float) -> Any:
    """Give row r another impulse; returns the change of its rate."""
    change = total - work.line[row.GIVEN, r]
    if change == 0.0:
        return 0.0
    work.line[row.GIVEN, r] = total
    for k in range(used):
        work.line[row.RATE, k] += work.gram[r, k] * change
    return abs(change * work.gram[r, r])


@compiled_in_place
def pressed(grip: float, work: Work, r: int) -> Any:
    """Normal and tangential impulse of a sphere: it sticks, slides or leaves the ground."""
    line, up, cross, side = (
        work.line,
        work.gram[r, r],
        work.gram[r, r + 1],
        work.gram[r + 1, r + 1],
    )
    rise = line[row.RATE, r] - up * line[row.GIVEN, r] - cross * line[row.GIVEN, r + 1]
    slip = line[row.RATE, r + 1] - cross * line[row.GIVEN, r] - side * line[row.GIVEN, r + 1]
    spring, damper = yielding(work, r)
    normal = (spring - damper * (rise - cross * slip / side)) / (
        1.0 + damper * (up - cross * cross / side)
    )
    tangent = -(slip + cross * normal) / side
    if normal > 0.0 and abs(tangent) <= grip * normal:
        return normal, tangent
    way = np.sign(tangent) if normal > 0.0 else -np.sign(slip)
    normal = max(0.0, spring - damper * rise) / max(1e-3, 1.0 + damper * (up + way * grip * cross))
    return normal, way * grip * normal


@compiled_in_place
def yielding(work: Work, r: int) -> Any:
    """Normal impulse of a sphere at the rate 0 after the substep, and its fall with that rate."""
    line, p = work.line, work.place[r]
    early = work.damping[p] * (1.0 - line[row.LATE, r]) * line[row.FIRST, r]
    return (
        line[row.TIME, r] * (-work.stiffness[p] * line[row.DEPTH, r] - early),
        work.damping[p] * line[row.LATE, r] * line[row.TIME, r],
    )


@compiled_in_place
def agreed(h: float, grip: float, work: Work, used: int) -> Any:
    """Solve for all impulses at once, with what holds, sticks and slides as it is now."""
    a, line, count = work.system, work.line, 0
    for r in range(used):
        if holds(h, grip, work, r):
            work.unknown[count] = r
            count += 1
    for i in range(count):
        r = work.unknown[i]
        a[i, count] = -line[row.RATE, r]
        for k in range(count):
            c = work.unknown[k]
            a[i, k] = work.gram[r, c]
            if work.kind[c] == row.NORMAL and slides(grip, line, c):
                a[i, k] += np.sign(line[row.GIVEN, c + 1]) * grip * work.gram[r, c + 1]
            a[i, count] += a[i, k] * line[row.GIVEN, c]
        complete(h, work, r, i, count)
    if not solved(a, count):
        return
    for i in range(count):
        r, total = work.unknown[i], a[i, count]
        if work.kind[r] == row.NORMAL and slides(grip, line, r):
            changed(work, used, r + 1, np.sign(line[row.GIVEN, r + 1]) * grip * total)
        if work.kind[r] == row.GAP:
            j = work.place[r]
            work.joint[row.SPEED, j] -= (total - line[row.GIVEN, r]) * share(h, work, j)
        changed(work, used, r, total)


@compiled_in_place
def holds(h: float, grip: float, work: Work, r: int) -> Any:
    """Whether the impulse of row r is what it takes, and not at a limit of its own."""
    kind, line = work.kind[r], work.line
    if kind == row.FRICTION:
        most = work.joint[row.LEVEL, work.place[r]] * h
        return abs(line[row.GIVEN, r]) < 0.999999 * most and abs(line[row.RATE, r]) < 1e-6
    if kind == row.TANGENT:
        return line[row.GIVEN, r - 1] > 0.0 and not slides(grip, line, r - 1)
    return line[row.GIVEN, r] != 0.0


@compiled_in_place
def slides(grip: float, line: Array, r: int) -> Any:
    return abs(line[row.GIVEN, r + 1]) >= 0.999999 * grip * line[row.GIVEN, r]


@compiled_in_place
def complete(h: float, work: Work, r: int, i: int, count: int) -> Any:
    """Add to equation i what is particular to its row r."""
    a, kind, j, joint = work.system, work.kind[r], work.place[r], work.joint
    given = work.line[row.GIVEN, r]
    a[i, i] += REDUNDANT * work.gram[r, r]
    if kind == row.NORMAL:
        spring, damper = yielding(work, r)
        a[i, i] += 1.0 / max(damper, 1e-30)
        a[i, count] += spring / max(damper, 1e-30)
    elif kind == row.STOP:
        way = (
            max(joint[row.HIGH, j] - joint[row.Q, j], 0.0)
            if given < 0.0
            else min(joint[row.LOW, j] - joint[row.Q, j], 0.0)
        )
        a[i, count] += way / h
    elif kind == row.GAP:
        motor = share(h, work, j)
        edge = (0.5 * joint[row.GAP_WIDTH, j] * np.sign(given) - joint[row.OFFSET, j]) / h
        a[i, i] += motor
        a[i, count] += joint[row.SPEED, j] + motor * given - edge


@compiled_in_place
def solved(a: Array, size: int) -> Any:
    """Solve in place by elimination, the solution in column `size`; whether there is one."""
    for i in range(size):
        if abs(a[i, i]) < 1e-12:
            return False
        for k in range(i + 1, size):
            factor = a[k, i] / a[i, i]
            if factor != 0.0:
                for c in range(i + 1, size + 1):
                    a[k, c] -= factor * a[i, c]
    for i in range(size - 1, -1, -1):
        for c in range(i + 1, size):
            a[i, size] -= a[i, c] * a[c, size]
        a[i, size] /= a[i, i]
    return True
