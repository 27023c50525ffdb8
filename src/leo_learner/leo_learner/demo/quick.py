# SPDX-License-Identifier: Apache-2.0
"""The quick demo: a shipped recording of a simulated robot with a secret, and the truth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
import shlex

import leo_diffmodel.verbs.explain
import leo_sim.verbs.reveal

SHIPPED = Path(__file__).resolve().parents[1] / 'quick'
"""Made by docs/make_quick.py."""
ROBOT = 'torque_pendulum'


def quick(folder: Path, as_json: bool = False) -> int:
    """Explain the recording into a folder, then open its truth, each as a person types it.

    Args:
        folder: of explain.json and the report.
        as_json: print both answers as JSON, a line each, and nothing else.
    """
    told = ['--json'] if as_json else []
    words = ['explain', str(SHIPPED / 'bag'), '--model', ROBOT, '-o', str(folder), *told]
    status = _typed(leo_diffmodel.verbs.explain.main, words, as_json)
    _typed(leo_sim.verbs.reveal.main, ['reveal', str(SHIPPED / 'secret.seal'), *told], as_json)
    if not as_json:
        print(f'report: {folder.resolve() / "report.html"}')
    return status


def _typed(verb: Callable[[list[str]], int], words: Sequence[str], silent: bool) -> int:
    if not silent:
        print(f'$ leo {shlex.join(words)}', flush=True)
    return verb([*words[1:]])
