# SPDX-License-Identifier: Apache-2.0
"""Phases of a walker: what its feet do in a window, as each joint sees it."""

from __future__ import annotations

import numpy as np

from leo_sim.description.robot import Robot
from leo_sim.model import Model

Array = np.ndarray
SWING, STANCE, DOUBLE = 'swing', 'stance', 'double support'
TOUCH_DOWN, LIFT_OFF = 'touch-down', 'lift-off'
FLIGHT, SINGLE = 'flight', 'single support'
LYING, HANGING = 'lying', 'hanging'


def carrying(model: Model, states: Array) -> Array:
    """Which spheres of robot.yaml the ground presses on at sensed states (W, K, 2J), (W, K, P)."""
    joints = states.shape[-1] // 2
    true = model.laws.true_state(states[..., :joints], states[..., joints:])
    forces: Array = model.spheres.forces(*true)
    return forces > 0.0


def phases(robot: Robot, pressed: Array, held: Array) -> list[Array]:
    """The phase of each window as each joint sees it: J arrays (W,) of words.

    Joints of one leg see their own foot: swing, stance, double support (the other foot carries
    too), touch-down, lift-off. The others see both. All see lying (something other than the
    feet carries) and hanging (the base is held).

    Args:
        robot: with feet and spheres.
        pressed: which spheres the ground presses on, (W, K, P).
        held: windows with a held base, (W,).
    """
    links = [contact.link for contact in robot.contacts]
    on = np.stack(
        [pressed[..., [link == foot for link in links]].any(axis=-1) for foot in robot.feet],
        axis=-1,
    )
    elsewhere = pressed[..., [link not in robot.feet for link in links]].any(axis=(1, 2))
    below = [_feet_below(robot, name) for name in robot.joint_names]
    words = [_of_leg(on, feet[0]) if len(feet) == 1 else _of_all(on) for feet in below]
    return [np.where(held, HANGING, np.where(elsewhere, LYING, w)) for w in words]


def _feet_below(robot: Robot, joint: str) -> list[int]:
    """Which feet move with a joint."""
    by_child = {j.child: j for j in robot.joints}
    found = []
    for index, foot in enumerate(robot.feet):
        above, link = [], foot
        while link in by_child:
            above.append(by_child[link].name)
            link = by_child[link].parent
        if joint in above:
            found.append(index)
    return found


def _of_leg(on: Array, foot: int) -> Array:
    """Of windows (W, K, feet), as the leg of one foot sees them, (W,)."""
    mine, all_feet = on[..., foot], on.all(axis=(1, 2))
    return np.select(
        [all_feet, mine.all(axis=1), ~mine.any(axis=1), mine[:, 0] & ~mine[:, -1]],
        [DOUBLE, STANCE, SWING, LIFT_OFF],
        TOUCH_DOWN,
    )


def _of_all(on: Array) -> Array:
    """Of windows (W, K, feet), as the trunk sees them, (W,)."""
    count = on.sum(axis=-1)
    steady = (on == on[:, :1]).all(axis=(1, 2))
    return np.select(
        [
            steady & (count[:, 0] == 0),
            steady & (count[:, 0] == 1),
            steady,
            count[:, -1] < count[:, 0],
        ],
        [FLIGHT, SINGLE, DOUBLE, LIFT_OFF],
        TOUCH_DOWN,
    )
