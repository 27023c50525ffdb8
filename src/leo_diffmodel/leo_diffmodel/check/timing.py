# SPDX-License-Identifier: Apache-2.0
"""Rates, gaps, jitter and stamps of the joint states, and what reading the bag left out."""

import itertools

import numpy as np

from leo_diffmodel.bags.recording import Recording, Recordings
from leo_diffmodel.check.settings import CHECK
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.outside.finding import Finding, OK, times, WARNING

HARMLESS = (
    'still being recorded',
    'no velocities; differentiated',
    'differentiated anew',
    'wraps by whole turns',
)


def timing(recording: Recording) -> list[Finding]:
    """Rate with its jitter, gaps, and what reading the bag left out."""
    return [_rate(recording), *_gaps(recording), *_reading(recording)]


def _reading(recording: Recording) -> list[Finding]:
    """What the reader warned of: dropped samples, undecodable messages, unusable inputs."""
    todo, out = 'look at the driver or the recorder; what is left is used', []
    for text in (w.removeprefix(f'{recording.path}: ') for w in recording.warnings):
        if not text.split(' ', 1)[-1].startswith('gaps;'):
            harmless = any(h in text for h in HARMLESS)
            out.append(Finding('reading', OK if harmless else WARNING, text, todo))
    return out


def _rate(recording: Recording) -> Finding:
    typical = recording.state_period
    jitter = float(np.quantile(np.abs(recording.steps - typical), 0.95)) / typical
    what = f'joint states at {1 / typical:.4g} Hz, '
    what += f'commands at {1 / recording.command_period:.4g} Hz; '
    what += f'95 % of the steps are within {100 * jitter:.1f} % of the median'
    if typical > CHECK.slow_states * recording.command_period:
        todo = 'record every joint state that the robot publishes'
        return Finding('rate', WARNING, f'{what}; states come more rarely than commands', todo)
    if jitter > CHECK.jitter:
        todo = 'stamp states where they are measured; explain uses the stamps as they are'
        return Finding('jitter', WARNING, what, todo)
    return Finding('rate', OK, what)


def _gaps(recording: Recording) -> list[Finding]:
    ends = [(float(a.t[-1]), float(b.t[0])) for a, b in itertools.pairwise(recording.episodes)]
    gaps = [(a, b) for a, b in ends if b > a]
    if not gaps or not any('gaps; split there' in w for w in recording.warnings):
        return []
    lost = sum(b - a for a, b in gaps)
    what = f'{len(gaps)} gaps, {lost:.2f} s in all: {times(gaps)}; no window crosses them'
    todo = 'recorder or network could not keep up: record on the robot, reliable, depth 1000'
    return [Finding('gaps', WARNING, what, todo, tuple(gaps))]


def length(recordings: Recordings) -> Finding:
    episodes = [e for r in recordings for e in r.episodes]
    seconds = sum(e.seconds for e in episodes)
    what = f'{seconds:.1f} s in {len(episodes)} {"episode" if len(episodes) == 1 else "episodes"}'
    if seconds < CHECK.short_seconds:
        return Finding('length', WARNING, what, 'record 20 s or more')
    return Finding('length', OK, what)


def even_stamps(recording: Recording) -> list[Finding]:
    """Whether the stamps of an imported log are frame / fps, which says nothing of the true times.

    LeRobot writes timestamp = frame_index / fps whatever the loop did. A clock that is read has
    jitter; stamps that lie on an even grid to their own rounding (of float32, or of the digits
    they were written with) were not read from one.
    """
    episodes = [e.t - e.t[0] for e in recording.episodes if len(e.t) >= CHECK.stamps]
    imported = 'imported_from' in recording.metadata and bool(episodes)
    if not imported or not all(map(is_even, episodes)):
        return []
    rate = 1 / float(np.median(np.concatenate([np.diff(t) for t in episodes])))
    what = f'stamps are frame / {rate:.4g} Hz, computed and not read from a clock: how late a '
    what += 'frame really was cannot be seen'
    todo = 'log the time at which each observation was read, and import that column as time'
    return [Finding('even_stamps', WARNING if rate < CHECK.paced else OK, what, todo)]


def is_even(t: Array) -> bool:
    """Whether times that begin at 0 [s], shape (T,), are multiples of a period."""
    step = np.diff(t)
    period, rounded = float(np.median(step)), _rounded_to(t)
    frame = np.r_[0, np.cumsum(np.round(step / period))]
    off = t - np.polyval(np.polyfit(frame, t, 1), frame)
    digits = CHECK.nearly_half * rounded if rounded <= CHECK.coarsest * period else 0.0
    allowed = max(float(np.spacing(np.float32(t[-1]))), digits) + CHECK.stamp_rounding
    return bool(np.abs(off).max() <= allowed)


def _rounded_to(t: Array) -> float:
    """The power of ten that times are multiples of [s]; 0 for none."""
    for digits in range(CHECK.digits):
        step = 10.0**-digits
        if np.abs(t - step * np.round(t / step)).max() <= CHECK.stamp_rounding:
            return step
    return 0.0


def slow(recording: Recording) -> list[Finding]:
    """Whether states come too rarely for friction at a turn, delay and backlash to show."""
    step = recording.state_period
    if step <= 1 / CHECK.slowest:
        return []
    what = f'joint states every {1e3 * step:.0f} ms ({1 / step:.3g} Hz): friction where a '
    what += 'joint turns, delays and backlash happen in between'
    todo = 'record at 100 Hz, 50 Hz at the least: the joints alone, no cameras in the loop'
    return [Finding('slow', WARNING, what, todo)]
