# SPDX-License-Identifier: Apache-2.0
"""The closing table of the main job."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
import shlex
from typing import Any

from rich.console import Console

from leo_learner.demo.main_job import Found, RIG
from leo_msgs_py.console import Table
from leo_msgs_py.terminal import leo

_KINDS = {'rmse': 'rms', 'median': 'median'}


def closing(found: Found, folder: Path, console: Console) -> None:
    """Print what was found and the truth, errors, returns and where the reports are."""
    table = Table(title=f'the main job, {found.seconds:.0f} s', show_header=False)
    table.add_column(style='bold')
    table.add_column(overflow='fold')
    table.add_row('named', named(found.repair))
    table.add_row('truth', described(found.truth['effects']))
    _add_error(table, found.repair, 'rmse')
    repaired = 'the repaired model' + (' + difference model' if found.difference else '')
    names = {'ideal': 'the ideal model', 'repaired': repaired, 'real': 'the robot itself'}
    for name, value in found.returns.items():
        table.add_row(f'return on the robot, trained on {names[name]}', f'{value:.1f}')
    reports = [folder / 'repair' / 'report.html']
    if found.measured:
        table.add_section()
        table.add_row('real pendulum, named', named(found.measured))
        _add_error(table, found.measured, 'median')
        reports.append(folder / RIG / 'repair' / 'report.html')
    console.print(table)
    for report in reports:
        console.print(f'report: {report.resolve()}', soft_wrap=True)
    console.print(f'watch the error fall: {shlex.join(watching(folder))}', soft_wrap=True)
    policy = (folder / 'repaired' / 'policy.safetensors').resolve()
    console.print(f'next: {leo("play", policy, "--model", "pendulum")}', soft_wrap=True)


def watching(folder: Path) -> list[str]:
    """The command of the live page on what a main job recorded."""
    rollout, out = (str(folder.resolve() / name) for name in ('rollout', 'watch'))
    return ['leo', 'watch', rollout, '--model', 'pendulum', '-o', out]


def named(answer: Mapping[str, Any]) -> str:
    """Verdict and effects of an explain.json, each with what it may be confused with."""
    if not answer['effects']:
        return f'{answer["verdict"]}: {answer["sentence"]}'
    lines = [described([effect]) + _confusable(effect) for effect in answer['effects']]
    return '\n'.join([f'({answer["verdict"]})', *lines])


def described(effects: Sequence[Mapping[str, Any]]) -> str:
    """Effects with place, values and units, one per line."""
    return '\n'.join(
        f'{effect["name"]} at {_place(effect["where"])}: '
        + ', '.join(_value(name, entry) for name, entry in effect['parameters'].items())
        for effect in effects
    )


def _place(where: str | Sequence[str]) -> str:
    return where if isinstance(where, str) else ', '.join(where)


def _value(name: str, entry: Mapping[str, Any]) -> str:
    text = f'{name} = {entry["value"]:.4g} {entry["unit"]}'.rstrip()
    if entry.get('ci95'):
        text += ' [{:.3g}, {:.3g}]'.format(*entry['ci95'])
    return text


def _confusable(effect: Mapping[str, Any]) -> str:
    others = [other['name'] for other in effect['confusable_with']]
    return f' (or {", ".join(others)})' if others else ''


def _add_error(table: Table, answer: Mapping[str, Any], kind: str) -> None:
    """Held-out errors as given, repaired and of noise alone.

    `kind` is rmse, or median where somebody may have pushed the robot.
    """
    ladder = answer['errors'].get('ladder')
    if not ladder:
        return
    given, repaired, floor = ladder[0], ladder[-2], ladder[-1]
    for k, state in enumerate(answer['errors']['states']):
        table.add_row(
            f'held-out {_KINDS[kind]} error after {given["seconds"]:.2g} s, {state["name"]}',
            f'{given[kind][k]:.4g} -> {repaired[kind][k]:.4g} {state["unit"]}, '
            f'noise floor {floor[kind][k]:.4g}',
        )
