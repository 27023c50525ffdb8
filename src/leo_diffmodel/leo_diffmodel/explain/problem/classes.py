# SPDX-License-Identifier: Apache-2.0
"""Effects that are the same thing in the data, whatever the excitation: named together.

Each class is a statement about the equations of motion (docs/reference/contracts.md); a test holds
every one of them against data.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_sim.description.robot import Constant, Robot
from leo_sim.effects.links import ASKEW
from leo_sim.model import Model


@dataclass(frozen=True)
class Facts:
    """What decides whether two effects are told apart; `ever_free`: some motor was off.

    `spared`: joints whose position servos never gave all that they have; `even`: those whose
    motors got voltages of one size alone.
    """

    robot: Robot
    ever_free: bool
    spared: frozenset[str] = frozenset()
    even: frozenset[str] = frozenset()

    @classmethod
    def of(cls, robot: Robot, recordings: Sequence[Recording]) -> 'Facts':
        episodes = [e for r in recordings for e in r.episodes]
        ever_free = any(bool((e.enabled < 0.5).any()) for e in episodes)
        on, servos = np.vstack([e.enabled for e in episodes]), Model(robot).laws.servos

        def named(which: np.ndarray) -> frozenset[str]:
            pairs = zip(robot.actuators, which, strict=True)
            return frozenset(a.joint for a, one in pairs if one)

        if servos is None:
            asked = np.abs(np.vstack([e.inputs for e in episodes]))
            most, least = (asked * on).max(axis=0), np.where(on > 0, asked, np.inf).min(axis=0)
            return cls(robot, ever_free, even=named(most <= least))
        asked = np.vstack([np.abs(servos.duty(e.inputs, e.q, e.dq)) for e in episodes])
        return cls(robot, ever_free, named((asked * on).max(axis=0) < 1.0))

    def alike(self, a: Candidate, b: Candidate) -> bool:
        return a == b or same_thing(a, b, self) is not None

    @property
    def alone(self) -> bool:
        """One joint on a fixed base, and no copy of it: all acts along or about one axis."""
        robot = self.robot
        return len(robot.joint_names) == 1 and robot.base == 'fixed' and not robot.copies

    def at_base(self, joint: str, slides: bool = False) -> bool:
        """Whether a joint that none mimics is a hinge (with `slides` a slide) at a fixed base."""
        joints = self.robot.joints
        found = next((j for j in joints if j.name == joint), None)
        if self.robot.base != 'fixed' or found is None or (joint in self.robot.slides) != slides:
            return False
        if any(j.leader == joint for j in joints):
            return False
        return self.body(found.parent) not in {j.child for j in joints}

    @property
    def swung_by(self) -> str:
        """The hinge that carries all the others, where all are about one level axis; else ''."""
        robot = self.robot
        roots = [j for j in robot.joint_names if self.at_base(j)]
        if len(roots) != 1 or robot.slides:
            return ''
        axes = np.vstack([axes for _, axes in robot.turned_about.values()])
        level = np.abs(axes[:, 2]).max() < ASKEW
        return roots[0] if level and np.abs(np.cross(axes, axes[0])).max() < ASKEW else ''

    def body(self, link: str) -> str:
        """The first of the links that are welded together with this one."""
        above = {j.child: j for j in self.robot.joints if j.kind == 'fixed'}
        while link in above:
            link = above[link].parent
        return link

    def refits(self, joint: str, constant: str) -> bool:
        """Whether a motor constant is refitted at a joint, or for 'all' at every one."""
        found = self._constants(joint, constant)
        return bool(found) and all(c and c.uncertain for c in found)

    def spares(self, joint: str, slowed: bool = True) -> bool:
        """Whether no servo of a joint or of 'all' ever gave all; `slowed`: it may have a D."""
        motors = {a.joint for a in self.robot.actuators if joint in (a.joint, 'all')}
        gains = (*self._constants(joint, 'rate_gain'), *self._constants(joint, 'damping'))
        plain = slowed or not any(c and (c.value or c.uncertain) for c in gains)
        return bool(motors) and motors <= self.spared and plain

    def _constants(self, joint: str, constant: str) -> list[Constant | None]:
        motors = (a.joint for a in self.robot.actuators if joint in (a.joint, 'all'))
        return [self.robot.constants.get(f'actuators.{motor}.{constant}') for motor in motors]


@dataclass(frozen=True)
class SameThing:
    """A class of effects, when it holds for a joint or 'all', and why, for the report."""

    names: frozenset[str]
    holds: Callable[[Facts, str], bool]
    why: str


CLASSES = (
    SameThing(
        frozenset({'viscous_friction', 'back_emf_scale'}),
        lambda f, _: f.robot.has_motor_law and not f.ever_free,
        'both brake in proportion to speed while the motor is never free',
    ),
    SameThing(
        frozenset({'command_delay', 'measurement_delay'}),
        lambda f, where: (f.alone or where == 'all') and not f.ever_free,
        'only the time between command and answer is seen',
    ),
    SameThing(
        frozenset({'armature', 'link_inertia'}),
        lambda f, where: f.at_base(where),
        'about a fixed axis all inertia adds up',
    ),
    SameThing(
        frozenset({'torque_scale', 'voltage_scale'}),
        lambda f, _: not f.robot.has_motor_law,
        'a torque command has no back-EMF to tell them apart',
    ),
    SameThing(
        frozenset({'back_emf_scale', 'torque_scale', 'voltage_scale'}),
        lambda f, where: f.refits(where, 'torque_constant'),
        'a refitted torque constant makes one of the other',
    ),
    SameThing(
        frozenset({'back_emf_scale', 'torque_scale', 'viscous_friction', 'voltage_scale'}),
        lambda f, where: f.refits(where, 'torque_constant') and not f.ever_free,
        'with a refitted torque constant friction and a weaker motor are one while it is never '
        'free',
    ),
    SameThing(
        frozenset({'encoder_offset', 'external_force', 'link_com', 'torque_ripple'}),
        lambda f, _: f.alone and not f.robot.slides,
        'on a single hinge a shifted zero, a shifted CoM, a sideways force and a ripple once per '
        'turn all turn gravity',
    ),
    SameThing(
        frozenset({'external_force', 'torque_ripple'}),
        lambda f, where: f.at_base(where),
        'about a fixed axis a constant force is a ripple once per turn',
    ),
    SameThing(
        frozenset({'encoder_offset', 'gravity'}),
        lambda f, where: where == f.swung_by,
        'what turns all that moves about a level axis turns gravity',
    ),
    SameThing(
        frozenset({'bias_torque', 'external_force'}),
        lambda f, where: f.at_base(where, slides=True),
        'along a fixed axis a constant force is one of the motor',
    ),
    SameThing(
        frozenset({'supply_sag', 'torque_scale'}),
        lambda f, where: f.alone and f.robot.has_motor_law and where in f.even,
        'one motor behind a resistance is as much weaker at every command of one size',
    ),
    SameThing(
        frozenset({'servo_stiffness', 'voltage_scale'}),
        lambda f, where: f.spares(where, slowed=False),
        'a loop without D that never gives all it has is as strong by its gain as by its supply',
    ),
    SameThing(
        frozenset({'back_emf_scale', 'servo_damping', 'viscous_friction'}),
        lambda f, where: f.spares(where) and not f.ever_free,
        'all brake in proportion to speed while a servo is never free and never gives all it has',
    ),
)

WELDED = 'link_inertia', 'payload', 'late_payload'
"""They add to the whole body, whichever of its links they are said of."""
PAIR = (
    'note: about a fixed axis a constant downward force is also a heavier link whose inertia '
    'about the joint is kept, link_mass with a negative link_inertia'
)


def same_thing(a: Candidate, b: Candidate, facts: Facts) -> str | None:
    """Why two candidates are the same in the data, or None where they are not."""
    return why_same((a.effect.name, a.where), (b.effect.name, b.where), facts)


def why_same(a: tuple[str, str], b: tuple[str, str], facts: Facts) -> str | None:
    """As `same_thing`, for effects as (name, place)."""
    if a[0] == b[0] and a[0] in WELDED and a[1] != b[1] and facts.body(a[1]) == facts.body(b[1]):
        return 'links that are welded together turn as one'
    pair, where = {a[0], b[0]}, _joint(a, facts)
    if len(pair) < 2 or where != _joint(b, facts):
        return None
    return next((c.why for c in CLASSES if pair <= c.names and c.holds(facts, where)), None)


def pair_note(candidates: Iterable[Candidate], facts: Facts) -> str | None:
    things = [(c.effect.name, c.where) for c in candidates]
    fixed = (thing[0] for thing in things if facts.at_base(_joint(thing, facts)))
    return PAIR if 'external_force' in fixed else None


def _joint(thing: tuple[str, str], facts: Facts) -> str:
    """The joint of an effect: a link moves with the one above it, a single one is all.

    Gravity acts on all that one hinge carries, if there is such a hinge.
    """
    name, where = thing
    if name == 'gravity':
        return facts.swung_by or where
    moved_by = {j.child: j.leader or j.name for j in facts.robot.joints}
    joint = moved_by.get(where, where)
    if joint == 'all' and len(facts.robot.joint_names) == 1:
        return facts.robot.joint_names[0]
    return joint
