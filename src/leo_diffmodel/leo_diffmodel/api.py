# SPDX-License-Identifier: Apache-2.0
"""The commands as functions: read_bag, compare, explain, add (docs/python.md).

Each calls what its command calls. What is slow to import is imported at the first call.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
import math
from pathlib import Path
from typing import TYPE_CHECKING
import warnings

if TYPE_CHECKING:
    from leo_diffmodel.bags.episode import Recording
    from leo_diffmodel.bags.topic_map import TopicMap
    from leo_diffmodel.results import Comparison, Explanation
    from leo_sim.description.robot import Robot
    from leo_sim.effects import Effect
    from leo_sim.model import Model

    Bags = Recording | str | Path | Sequence[Recording | str | Path]
    """One bag or several, read already or as paths."""

__all__ = ['add', 'compare', 'explain', 'read_bag']


def read_bag(
    path: str | Path, robot: Robot | str | Path, topic_map: str | Path | TopicMap | None = None
) -> Recording:
    """Read a bag: `leo_diffmodel.bags.recording.read_bag`."""
    from leo_diffmodel.bags.recording import read_bag as read

    return read(path, robot, topic_map)


def compare(
    bags: Bags,
    model: Model | str | Path,
    *,
    step: float | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Comparison:
    """How wrong a model is on recordings, where, and how much of it is only noise.

    Args:
        bags: of one robot; a passive one counts too.
        model: a model, a model file, the name of a robot or its folder.
        step: length of one step [s]; by default the control period of the data.
        progress: hears what comes next.

    Raises:
        UserError: no such bag or model, the same bag twice, or too little data.
    """
    from leo_diffmodel.compare.comparison import compare as compared
    from leo_diffmodel.results import Comparison

    model = _alone(model)
    return Comparison.of(compared(_read(bags, model), model, step, progress).data)


def explain(
    bags: Bags,
    model: Model | str | Path,
    *,
    hold_out: Bags = (),
    effects: Iterable[Effect | str | Path] = (),
    step: float | None = None,
    within: float = math.inf,
    keep: bool = False,
    mend: bool = False,
    edit_test: Bags = (),
    progress: Callable[[str], None] = lambda _: None,
) -> Explanation:
    """Which physical effect a model lacks, how large, how sure, or that nothing is missing.

    Args:
        bags: of one robot, to learn from.
        model: a model, a model file, the name of a robot or its folder.
        hold_out: bags no fit may see; by default every fourth time block is held out.
        effects: of your own besides the known ones; naming a Python file here lets it run.
        step: length of the one step that errors are given for [s]; by default the control period
            of the data.
        within: time for the answer [s]; it is then the best that has come to its end, and says so.
        keep: use what looks moved from outside or badly logged, too.
        mend: undo what is surely wrong with the log, and go on; else that is the answer.
        edit_test: bags of the robot after what is named was taken out of it.
        progress: hears what is being tried.

    Raises:
        UserError: no such bag, model or effect, or the same bag twice.
    """
    from leo_diffmodel.bags.episode import distinct
    from leo_diffmodel.explain.edit_test import edit_test as edited
    from leo_diffmodel.explain.explanation import explain as explained
    from leo_diffmodel.results import Explanation
    from leo_sim.effects import Effect, get_effect, registered_effects

    named = [e if isinstance(e, Effect) else get_effect(str(e)) for e in effects]
    extra = [*registered_effects(), *named]
    model = _alone(model)
    recordings, held = _read(bags, model), _read(hold_out, model)
    changed = _read(edit_test, model)
    distinct([*recordings, *held, *changed])
    found = explained(
        recordings, model, held, extra, progress, step, within=within, keep=keep, mend=mend
    )
    if changed and found.effects:
        found = replace(found, edit_test=edited(model, found.model, changed, step, progress))
    return Explanation.of(found.to_json(), found.model)


def add(
    model: Model | str | Path,
    what: Explanation | str | Path,
    where: str | Sequence[str] = 'all',
    *,
    sibling: bool = False,
    **parameters: float,
) -> Model:
    """A model with effects added; its history says why. `leo_sim.model.save_model` writes it.

    Args:
        model: a model, a model file, the name of a robot or its folder.
        what: an explanation, the path of an explain.json, or the name of an effect.
        where: of an effect by name: joint or link, several, or `all`.
        sibling: an explanation may be of another robot with joints and links of the same names.
        parameters: of an effect by name, in its units: `add('pendulum', 'coulomb_friction',
            'pivot', c=0.002)`.

    Raises:
        UserError: another robot's explanation, nothing named in it; no such effect, place or
            parameter, a value out of its bounds.
    """
    from leo_diffmodel.add import patch
    from leo_diffmodel.add.plausible import doubts
    from leo_diffmodel.results import Explanation

    model = _model(model)
    if isinstance(what, Explanation):
        changed, entries = patch.from_data(model, what.json, 'the explanation', sibling)
    elif isinstance(what, Path) or what.endswith('.json'):
        changed, entries = patch.from_explanation(model, what, sibling)
    else:
        changed, entries = patch.by_name(model, what, where, parameters)
    for line in doubts(model, changed, 'the new model'):
        warnings.warn(line, stacklevel=2)
    return changed.changed(history=(*model.history, *entries))


def _model(model: Model | str | Path) -> Model:
    from leo_sim.model import Model
    from leo_sim.model.model_file import load_model

    return model if isinstance(model, Model) else load_model(model)


def _alone(model: Model | str | Path) -> Model:
    """A model without its difference model, as none is used; that it has one is warned of."""
    model = _model(model)
    if model.difference_model is None:
        return model
    said = f'the model is taken without its difference model {model.difference_model}'
    warnings.warn(said, stacklevel=3)
    return model.changed(difference_model=None)


def _read(bags: Bags, model: Model) -> list[Recording]:
    """Recordings of the model's robot; what a bag warns of is warned of."""
    from leo_diffmodel.bags.episode import by_rate, distinct, Recording

    several = [bags] if isinstance(bags, Recording | str | Path) else bags
    recordings = []
    for bag in several:
        if isinstance(bag, Recording):
            recordings.append(bag)
            continue
        recordings.append(read_bag(bag, model.robot))
        for text in recordings[-1].warnings:
            warnings.warn(text, stacklevel=3)
    distinct(recordings)
    return by_rate(recordings)
