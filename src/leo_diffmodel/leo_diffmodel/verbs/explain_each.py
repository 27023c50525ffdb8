# SPDX-License-Identifier: Apache-2.0
"""leo explain --each: every bag by itself, each robot of a fleet beside the others."""

import argparse
from collections.abc import Sequence
from contextlib import redirect_stderr
from dataclasses import dataclass, replace
import io
import json
import math
from pathlib import Path
import sys
import time
from typing import Any

from leo_diffmodel.compare.known import provenance, with_known
from leo_diffmodel.explain.decide import Rule
from leo_diffmodel.explain.explanation import explain, none_yet
from leo_diffmodel.fleet.outliers import Figure, fleet
from leo_diffmodel.fleet.workers import Workers
from leo_diffmodel.report.explained import write_explanation
from leo_diffmodel.verbs import common
from leo_msgs_py.console import progress
from leo_msgs_py.ending import Ended, ending
from leo_msgs_py.errors import one_line, UserError
from leo_msgs_py.whole_file import json_text, write_whole
from leo_sim.common.cores import cores, using
from leo_sim.effects import EFFECTS

OF_A_RUN = ('command', 'date')
"""What may differ in the provenance of an answer that is taken over from an earlier run."""
ASKED = ('topic_map', 'begin', 'end', 'step', 'keep', 'mend', 'effect')


@dataclass(frozen=True)
class Answer:
    name: str
    told: dict[str, Any] | None = None
    rules: tuple[Rule, ...] = ()  # none where it is of an earlier run
    warnings: str = ''
    error: str = ''


@dataclass(frozen=True)
class Asked:
    """What every bag is asked, and how much time and how many cores there are."""

    arguments: argparse.Namespace
    folder: Path | None
    until: float  # s of `time.time`, which processes of several machines share
    bags: int
    at_once: int

    def __call__(self, task: tuple[int, str, str]) -> Answer:
        """The answer to a bag by its number, name and path; read where it is there already."""
        number, name, bag = task
        rounds = math.ceil((self.bags - number) / self.at_once)
        given = argparse.Namespace(**{**vars(self.arguments), 'bags': [bag]})
        alone, said = self.at_once == 1, io.StringIO()
        with redirect_stderr(said), using(given.jobs if alone else 1):
            try:
                answer = self._answer(given, name, (self.until - time.time()) / rounds)
            except UserError as error:
                answer = Answer(name, error=one_line(error))
        return replace(answer, warnings=said.getvalue())

    def _answer(self, given: argparse.Namespace, name: str, within: float) -> Answer:
        own, model = common.own_effects(given), common.named_model(given.model)
        recordings, _ = common.read_all(given, model)
        asked = {name: getattr(self.arguments, name) for name in ASKED}
        origin = {**provenance(recordings, with_known(model, recordings)), 'asked': asked}
        if self.folder and (kept := _kept(self.folder / name, origin)):
            return Answer(name, kept)
        chosen = {'step': given.step, 'within': within, 'keep': given.keep, 'mend': given.mend}
        heard = [none_yet(model)]
        try:
            with ending(time.monotonic() + within):
                heard.append(explain(recordings, model, (), own, so_far=heard.append, **chosen))
        except Ended as early:
            if not early.in_time:
                raise
        found = replace(heard[-1], provenance=origin)
        answer = Answer(name, found.to_json(), found.rules)
        try:
            inside = self.folder and self.folder / name
            if inside and found.complete:
                write_explanation(inside, found, recordings, common.watch(given))
            elif inside:  # a report there is of an answer of before
                (inside / 'report.html').unlink(missing_ok=True)
                write_whole(inside / 'explain.json', json_text(found.to_json()))
        except (OSError, UserError) as error:  # it took long, and is told
            return replace(answer, error=str(error))
        return answer


def _kept(folder: Path, origin: dict[str, Any]) -> dict[str, Any] | None:
    """The answer of an earlier run to the same bag, model and arguments that came to its end."""
    try:
        told = json.loads((folder / 'explain.json').read_text())
        before = told['provenance']
    except (OSError, ValueError, LookupError):
        return None
    same = all(before.get(name) == origin[name] for name in origin if name not in OF_A_RUN)
    return told if same and told.get('complete') else None


def explain_each(arguments: argparse.Namespace, folder: Path | None) -> list[Answer]:
    """Explain every bag by itself, in DIR/NAME; DIR/fleet.json and a table hold them together."""
    common.named_model(arguments.model)
    names, jobs = unique_names(arguments.bags), arguments.jobs or cores()
    at_once = len(names) if arguments.scheduler else min(jobs, len(names))
    ask = Asked(arguments, folder, time.time() + common.left(arguments), len(names), at_once)
    tasks = [*zip(range(len(names)), names, arguments.bags, strict=True)]
    answers: list[Answer] = []
    try:
        with ending(), progress('explaining', len(names), common.left(arguments)) as reporter:
            for answer in Workers(jobs, arguments.scheduler).each(ask, tasks):
                answers.append(answer)
                reporter(answer.name)
    finally:  # of those that are done, where it was interrupted
        answers.sort(key=lambda a: names.index(a.name))
        _tell(arguments, folder, answers)
    return answers


def _tell(arguments: argparse.Namespace, folder: Path | None, answers: list[Answer]) -> None:
    from leo_diffmodel.verbs.fleet_table import show

    for line in dict.fromkeys(line for a in answers for line in a.warnings.splitlines()):
        print(line, file=sys.stderr)
    told = {a.name: a.told for a in answers if a.told is not None}
    rows = fleet(told, _off(arguments))
    if folder and told:
        verdicts = {name: answer['verdict'] for name, answer in told.items()}
        write_whole(folder / 'fleet.json', json_text({'verdicts': verdicts, 'figures': rows}))
    if arguments.json:
        print(json.dumps({'bags': told, 'figures': rows}))
    elif told:
        show(told, rows, folder)


def _off(arguments: argparse.Namespace) -> Any:
    """At which value of a figure its effect does nothing, on the robot of the arguments."""
    robot = common.named_model(arguments.model).robot
    known = EFFECTS | {effect.name: effect for effect in common.own_effects(arguments)}

    def off(figure: Figure) -> float | None:
        name, _, where = figure.what.partition(':')
        if not where or name not in known:
            return None
        parameters = known[name].parameters_for(robot, (where,))
        found = (p.neutral for p in parameters if p.name == figure.parameter and p.scales)
        return next(found, None)

    return off


def unique_names(bags: Sequence[str]) -> list[str]:
    """The last parts of the paths in which they differ, as names of folders."""
    paths = [Path(bag).resolve() for bag in bags]
    if names := common.apart(paths, '_'):
        return names
    twice = next(path for path in paths if paths.count(path) > 1)
    raise UserError(f'{twice} is the same bag again; give each once')
