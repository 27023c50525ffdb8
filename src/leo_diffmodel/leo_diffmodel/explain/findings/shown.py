# SPDX-License-Identifier: Apache-2.0
"""The angles, speeds and loads at which the data show an answer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leo_diffmodel.compare.conditions import carried, folded
from leo_diffmodel.compare.sizes import length_unit, torque_unit
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.findings.findings import Range, Shown
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_sim.model import Model

Array = np.ndarray


def shown_for(
    windows: Windows, model: Model, candidates: Sequence[Candidate], facts: Facts
) -> tuple[Shown, ...]:
    """Where each joint at which named effects act was, by the windows of all recordings.

    The load is the torque that the gear transmits, the motor's less gravity's, of which
    load-dependent friction is a share: its mean over a window.

    Args:
        windows: what the effects were fitted to and judged on.
        model: with the effects.
        candidates: the effects.
        facts: which joint moves a link.
    """
    load, robot = carried(windows, model), model.robot
    places = {p for c in candidates for p in _joints(c, facts)}
    return tuple(
        Shown(
            name,
            _range(folded(windows.q[..., j]), length_unit(robot, name)),
            _range(windows.dq[..., j], f'{length_unit(robot, name)}/s'),
            _range(load[:, j], torque_unit(robot, name)),
        )
        for j, name in enumerate(robot.joint_names)
        if name in places
    )


def _joints(candidate: Candidate, facts: Facts) -> list[str]:
    """The joints at which an effect acts: of a link the one that moves it; none of the ground."""
    moved_by = {j.child: j.leader or j.name for j in facts.robot.joints}
    alone = candidate.where != 'all'
    places = [candidate.where] if alone else candidate.effect.places(facts.robot)
    return [moved_by.get(facts.body(place), place) for place in places]


def _range(values: Array, unit: str) -> Range:
    """Ends between which all but the outermost samples lie, one in a hundred to each side."""
    low, high = np.percentile(values, (1, 99))
    return Range(float(low), float(high), unit)
