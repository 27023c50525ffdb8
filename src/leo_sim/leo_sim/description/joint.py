# SPDX-License-Identifier: Apache-2.0
"""A joint of a tree, as plain numbers, and the units of one that slides."""

from collections.abc import Sequence
from dataclasses import dataclass

Vector = tuple[float, float, float]
Matrix = tuple[float, ...]
PAIRS = (('N m', 'N'), ('kg m2', 'kg'), ('rad', 'm'), ('turn', 'm'))
"""Unit of turning, unit of sliding."""


@dataclass(frozen=True)
class Joint:
    """A joint of the tree, parents before children.

    Attributes:
        kind: 'revolute', 'continuous', 'prismatic' or 'fixed'.
        parent, child: Link names.
        rotation: Joint frame to parent link frame at angle 0, row by row.
        translation: Joint origin in the parent link frame, m.
        axis: Unit vector in the joint frame.
        limits: Lowest and highest angle rad (m), infinite for none.
        damping: N m s/rad (N s/m); of a joint that is copied with what its copies add.
        leader: The joint whose angle it copies; empty for one that is fixed or free.
        ratio: Its angle for 1 rad (m) of the leader.
    """

    name: str
    kind: str
    parent: str
    child: str
    rotation: Matrix
    translation: Vector
    axis: Vector
    limits: tuple[float, float]
    damping: float
    leader: str = ''
    ratio: float = 1.0

    @property
    def independent(self) -> bool:
        """Whether it is a coordinate of the robot: it moves, and copies no other joint."""
        return self.kind != 'fixed' and not self.leader


def columns(joints: Sequence[Joint]) -> list[int]:
    """Where each joint is in a state vector: a copy where its leader is, -1 for a fixed one."""
    free = {joint.name: i for i, joint in enumerate(j for j in joints if j.independent)}
    return [free.get(joint.leader or joint.name, -1) for joint in joints]


def sliding(unit: str) -> str:
    """The unit on a slide of what has this unit on a hinge: `N m s/rad` is `N s/m`."""
    for turning, along in PAIRS:
        unit = unit.replace(turning, along)
    return unit
