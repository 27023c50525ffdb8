# SPDX-License-Identifier: Apache-2.0
"""Where a result comes from, so that it can be made again."""

from __future__ import annotations

from collections.abc import Sequence
import datetime
import hashlib
from importlib.metadata import version
import json
from pathlib import Path
import platform
import shlex
import sys

from leo_diffmodel.bags.recording import Recording
from leo_sim.model import Model

PACKAGES = ('leo_sim', 'leo_diffmodel', 'numpy', 'scipy', 'pybullet')


def provenance(recordings: Sequence[Recording], model: Model) -> dict:
    """Bags with their hashes, the model, versions, the command line and the date."""
    return {
        'bags': [_bag(r) for r in recordings],
        'robot': model.robot.name,
        'model_sha256': _digest(model),
        'effects_in_model': [p.effect.name for p in model.effects],
        'command': shlex.join([_program(sys.argv[0]), *sys.argv[1:]]),
        'date': datetime.datetime.now(datetime.UTC).isoformat(timespec='seconds'),
        'python': platform.python_version(),
        'versions': {name: version(name) for name in PACKAGES},
        'seed': 0,
    }


def _program(path: str) -> str:
    """The program as a person types it: leo, also where Python ran it by another way."""
    return 'leo' if path in ('-c', '-m') or Path(path).name in ('leo', 'cli.py') else path


def _bag(recording: Recording) -> dict:
    """A bag, its hash, and the constants that it knows of itself."""
    known = {'constants': dict(recording.constants)} if recording.constants else {}
    return {'path': str(recording.path), 'sha256': recording.sha256, **known}


def _digest(model: Model) -> str:
    """Hash of the physics: the tree, every constant, every effect with its values."""
    effects = [(p.effect.name, p.where, dict(p.parameters)) for p in model.effects]
    parts = [model.robot.urdf, model.constants, effects]
    parts += [model.by_recording] if model.by_recording else []
    text = json.dumps(parts, sort_keys=True, default=float)
    return hashlib.sha256(text.encode()).hexdigest()
