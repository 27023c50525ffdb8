# SPDX-License-Identifier: Apache-2.0
"""Several periods of a robot on the ground in one compiled call, under laws that stay the same."""

from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Indices
from leo_sim.common.compiled import compiled_without_gil
from leo_sim.dynamics.contact_kernel import advance, Forces, Motion, Play
from leo_sim.dynamics.ground import Floor, touched, untouched
from leo_sim.dynamics.planar import POSE, poses, Tree, weighed, World


@compiled_without_gil
def advance_periods(
    motion: Motion,
    last: Array,
    tree: Tree,
    world: World,
    floor: Floor,
    forces: Forces,
    play: Play,
    h: Array,
    inner: int,
    count: int,
    held: Indices,
    axes: tuple[int, ...],
) -> Any:
    """Move states in place by `count` periods of `inner` substeps of h s.

    Args:
        motion: `contact_kernel.Motion`, before, and after.
        last: Rates one period before, (N, J), and after.
        tree: `planar.Tree`.
        world: `planar.World`.
        floor: `ground.Floor`.
        forces: `contact_kernel.Forces`, the bias not yet taken off.
        play: `contact_kernel.Play`.
        h: s, (N or 1,).
        inner: Substeps of a period.
        count: Periods.
        held: How many joints, the first ones, do not move, (N or 1,).
        axes: A tuple with one entry per joint, see `contact_kernel.Work`.
    """
    states, size = motion.q.shape
    middle, ahead = np.empty((states, size)), np.empty((states, size))
    mass, bias = np.empty((states, size, size)), np.empty((states, size))
    touch = untouched(middle, floor)
    pose, lever = np.zeros((tree.kind.shape[0], POSE)), np.empty((3, size))
    impulses = np.zeros((*touch.over.shape, 2))
    for _ in range(count):
        for n in range(states):
            half = 0.5 * inner * h[n if h.shape[0] > 1 else 0]
            for j in range(size):
                middle[n, j] = motion.q[n, j] + half * motion.dq[n, j]
                ahead[n, j] = 1.5 * motion.dq[n, j] - 0.5 * last[n, j]
                last[n, j] = motion.dq[n, j]
            poses(tree, n, middle, ahead, pose)
            weighed(tree, world, n, pose, lever, mass, bias)
            touched(tree, floor, n, pose, lever, touch)
        driven = Forces(
            forces.smooth - bias,
            forces.drag,
            forces.at,
            forces.rotor,
            forces.level,
            forces.low,
            forces.high,
        )
        advance(motion, mass, driven, play, touch, h, inner, held, impulses, axes)
        _linked(motion, play)


@compiled_without_gil
def _linked(motion: Motion, play: Play) -> Any:
    """Motor sides without play turn as their joints do."""
    for n in range(motion.q.shape[0]):
        gap = play.gap[n if play.gap.shape[0] > 1 else 0]
        for j in range(motion.q.shape[1]):
            if gap[j] <= 0.0:
                motion.speed[n, j] = motion.dq[n, j]
