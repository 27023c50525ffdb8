# SPDX-License-Identifier: Apache-2.0
"""What the result was made from, so that it can be made again."""

from collections.abc import Mapping
from typing import Any

from leo_diffmodel.bags.recording import Recording, Recordings
from leo_diffmodel.report.page import Section
from leo_diffmodel.report.text import number, numbered, quantity


def section(provenance: Mapping[str, Any], recordings: Recordings, seconds: float) -> Section:
    """Bags with hashes, length and rate; model, versions, command, date and runtime [s]."""
    hashes = {bag['path']: bag['sha256'] for bag in provenance['bags']}
    values = {
        'bags': [
            {'number': number, **_bag(r, hashes.get(str(r.path), r.sha256))}
            for number, r in zip(numbered(recordings), recordings, strict=True)
        ],
        'facts': {
            'robot': provenance['robot'],
            'model sha256': provenance['model_sha256'],
            'effects already in the model': ', '.join(provenance['effects_in_model']) or 'none',
            'command': provenance['command'],
            'date': provenance['date'],
            'runtime': quantity(seconds, 's', 2),
            'seed': provenance['seed'],
            'python': provenance['python'],
            'versions': ', '.join(f'{n} {v}' for n, v in provenance['versions'].items()),
        },
    }
    return Section('origin.html', values)


def _bag(recording: Recording, sha256: str) -> dict[str, Any]:
    return {
        'path': str(recording.path),
        'sha256': sha256,
        'seconds': float(recording.steps.sum()),
        'episodes': len(recording.episodes),
        'samples': sum(len(e.t) for e in recording.episodes),
        'hertz': 1.0 / recording.state_period,
        'warnings': list(recording.warnings),
        'constants': [f'{path} = {number(v)}' for path, v in recording.constants.items()],
    }
