# SPDX-License-Identifier: Apache-2.0
"""Rates, gaps and jitter of the joint states, and what reading the bag had to leave out."""

from __future__ import annotations

from collections.abc import Sequence
import itertools

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import Finding, OK, times, WARNING

JITTER = 0.2
SLOW_STATES = 1.5
SHORT_SECONDS = 10.0
HARMLESS = (
    'still being recorded',
    'no velocities; differentiated',
    'differentiated anew',
    'wraps by whole turns',
)


def timing(recording: Recording) -> list[Finding]:
    """Rate with its jitter, and gaps."""
    return [_rate(recording), *_gaps(recording)]


def reading(recording: Recording) -> list[Finding]:
    """What the reader warned of: dropped samples, undecodable messages, unusable inputs."""
    told = [w.removeprefix(f'{recording.path}: ') for w in recording.warnings]
    return [
        Finding(
            'reading',
            OK if any(h in text for h in HARMLESS) else WARNING,
            text,
            todo='look at the driver or the recorder; what is left is used',
        )
        for text in told
        if not text.split(' ', 1)[-1].startswith('gaps;')
    ]


def steps(recording: Recording) -> np.ndarray:
    """Time from state to state within episodes [s]."""
    return np.concatenate([np.diff(e.t) for e in recording.episodes])


def _rate(recording: Recording) -> Finding:
    step = steps(recording)
    period = float(np.median(step))
    jitter = float(np.quantile(np.abs(step - period), 0.95)) / period
    what = (
        f'joint states at {1 / period:.4g} Hz, commands at {1 / recording.command_period:.4g} Hz; '
        f'95 % of the steps are within {100 * jitter:.1f} % of the median'
    )
    if period > SLOW_STATES * recording.command_period:
        todo = 'record every joint state that the robot publishes'
        return Finding('rate', WARNING, f'{what}; states come more rarely than commands', (), todo)
    if jitter > JITTER:
        todo = 'stamp states where they are measured; explain uses the stamps as they are'
        return Finding('jitter', WARNING, what, (), todo)
    return Finding('rate', OK, what)


def _gaps(recording: Recording) -> list[Finding]:
    ends = [(a.t[-1], b.t[0]) for a, b in itertools.pairwise(recording.episodes)]
    told = sum('gaps; split there' in w for w in recording.warnings)
    gaps = [(float(a), float(b)) for a, b in ends if b > a] if told else []
    if not gaps:
        return []
    lost = sum(b - a for a, b in gaps)
    what = f'{len(gaps)} gaps, {lost:.2f} s in all: {times(gaps)}; no window crosses them'
    todo = 'recorder or network could not keep up: record on the robot, reliable, depth 1000'
    return [Finding('gaps', WARNING, what, tuple(gaps), todo)]


def length(recordings: Sequence[Recording]) -> Finding:
    """Of all bags together."""
    episodes = [e for r in recordings for e in r.episodes]
    seconds = sum(float(e.t[-1] - e.t[0]) for e in episodes)
    what = f'{seconds:.1f} s in {len(episodes)} {"episode" if len(episodes) == 1 else "episodes"}'
    if seconds < SHORT_SECONDS:
        return Finding('length', WARNING, what, (), 'record 20 s or more')
    return Finding('length', OK, what)
