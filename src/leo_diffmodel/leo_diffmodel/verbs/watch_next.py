# SPDX-License-Identifier: Apache-2.0
"""What leo watch proposes to record next: what leo next proposes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TYPE_CHECKING

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.verbs import common, watch
from leo_sim.model import Model

if TYPE_CHECKING:
    from leo_diffmodel.next_run.motions import MotionRun
    from leo_diffmodel.next_run.proposed_run import Run
    from leo_diffmodel.watch.plan import Plan


def proposed(argv: list[str], answer: dict[str, Any], heard: Callable[[str], None]) -> Plan:
    """What `leo next` says to the same bags and what explain said of them.

    Args:
        argv: as of `asked`.
        answer: the contents of explain.json.
        heard: told what is being looked at.

    Raises:
        UserError: the robot has no motors, or the bags are too short to plan from.
    """
    from leo_diffmodel.next_run.proposal import propose
    from leo_diffmodel.verbs import next_text
    from leo_diffmodel.verbs.next import check_driven, SECONDS
    from leo_diffmodel.watch.plan import Plan

    arguments = watch.parser().parse_args(argv)
    model = common.load(arguments)
    check_driven(model)
    recordings, _ = common.read_all(arguments, model)
    own = common.own_effects(arguments)
    found = propose(recordings, model, answer, own, SECONDS, heard)
    words = tuple(next_text.told(found, answer, SECONDS))
    if found.best is None:
        return Plan(words, model.robot)
    run = found.best.run
    heard(f'predicting {run.name}')
    return Plan(words, model.robot, run, _predicted(run, model, answer, recordings))


def _predicted(
    run: Run | MotionRun, model: Model, answer: dict[str, Any], recordings: list[Recording]
) -> Recording:
    """What the model with what was named makes of a run."""
    from leo_diffmodel.add.patch import from_data
    from leo_diffmodel.compare.known import with_known
    from leo_diffmodel.compare.windows import sample_period
    from leo_diffmodel.next_run.simulate import simulate

    repaired = from_data(model, answer, 'the explanation')[0] if answer['effects'] else model
    (track,) = simulate([run], with_known(repaired, recordings), sample_period(recordings))
    return track
