# SPDX-License-Identifier: Apache-2.0
"""Effects that are the same thing in the data, whatever the excitation: named together.

Each class is a statement about the equations of motion (design.md section 6); a test holds
every one of them against data.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from leo_diffmodel.explain.hypothesis import Candidate
from leo_sim.robot import Robot


@dataclass(frozen=True)
class Facts:
    """What decides whether two effects can be told apart.

    Attributes:
        robot: the robot.
        ever_free: some motor was switched off during the data.
    """

    robot: Robot
    ever_free: bool

    @property
    def one_hinge(self) -> bool:
        """One joint on a fixed base: all inertia acts about one axis."""
        return len(self.robot.joint_names) == 1 and self.robot.base == 'fixed'


@dataclass(frozen=True)
class SameThing:
    """A class of effects and when it holds.

    Attributes:
        names: the members.
        holds: the condition.
        why: the reason, for the report.
    """

    names: frozenset[str]
    holds: Callable[[Facts], bool]
    why: str


CLASSES = (
    SameThing(
        frozenset({'viscous_friction', 'back_emf_scale'}),
        lambda f: f.robot.input == 'voltage' and not f.ever_free,
        'both brake in proportion to speed while the motor is never free',
    ),
    SameThing(
        frozenset({'command_delay', 'measurement_delay'}),
        lambda f: True,
        'only the time between command and answer is seen',
    ),
    SameThing(
        frozenset({'armature', 'link_inertia'}),
        lambda f: f.one_hinge,
        'on a single hinge all inertia adds up',
    ),
    SameThing(
        frozenset({'torque_scale', 'voltage_scale'}),
        lambda f: f.robot.input == 'torque',
        'a torque command has no back-EMF to tell them apart',
    ),
    SameThing(
        frozenset({'encoder_offset', 'external_force', 'link_com', 'torque_ripple'}),
        lambda f: f.one_hinge,
        'on a single hinge a shifted zero, a shifted CoM, a sideways force and a ripple once per '
        'turn all turn gravity',
    ),
)

PAIRS = {
    'external_force': (
        'note: on a single hinge a constant downward force is also a heavier link whose inertia '
        'about the joint is kept, link_mass with a negative link_inertia'
    ),
}


def same_thing(a: Candidate, b: Candidate, facts: Facts) -> str | None:
    """Why two candidates are the same in the data, or None where they are not."""
    if not _share_joint(a, b, facts):
        return None
    pair = {a.effect.name, b.effect.name}
    for entry in CLASSES:
        if len(pair) == 2 and pair <= entry.names and entry.holds(facts):
            return entry.why
    return None


def pair_note(candidates: Iterable[Candidate], facts: Facts) -> str | None:
    """What pair of effects could stand for a named one."""
    if not facts.one_hinge:
        return None
    return next((PAIRS[c.effect.name] for c in candidates if c.effect.name in PAIRS), None)


def _share_joint(a: Candidate, b: Candidate, facts: Facts) -> bool:
    return facts.one_hinge or a.where == b.where
