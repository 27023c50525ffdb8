# SPDX-License-Identifier: Apache-2.0
"""A recording: episodes of states and inputs, what is known of it; its parts by time and rate."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
import itertools
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from leo_msgs_py.errors import UserError
from leo_sim.common.yaml_file import shown

from .types import at_rows, Floats

NEAR = 1.05  # times: periods of one log are no further apart
LEAST = 2.0  # s in one episode, for a rate of its own to count: less is no recording


@dataclass(frozen=True, eq=False)
class Episode:
    """One stretch of a recording without reset, restart or gap; steps may be uneven."""

    t: Floats  # since the first state of the recording [s], shape (T,), increasing
    q: Floats  # joint positions [rad, m], shape (T, J), columns in `Recording.joints` order
    dq: Floats  # joint velocities [rad/s, m/s], shape (T, J)
    # [V, N m or rad], shape (T, A), columns as `Recording.actuators`; row k acts from t[k] to
    # t[k + 1] (mean of what was held meanwhile), the last row from t[-1] on
    inputs: Floats
    # False where the motor was free (torque off, or a passive log), shape (T, A)
    enabled: NDArray[np.bool_]
    # measured torques [N m], shape (T, J), NaN where not measured; None without any
    effort: Floats | None = None

    @property
    def period(self) -> float:
        return float(np.median(np.diff(self.t)))

    @property
    def seconds(self) -> float:
        return float(self.t[-1] - self.t[0])


@dataclass(frozen=True, eq=False)
class Recording:
    path: Path
    sha256: str  # of the bytes of its .mcap or .db3 files
    joints: tuple[str, ...]  # in the robot's order
    actuators: tuple[str, ...]  # their joints, in actuator order
    input: str  # `voltage`, `torque`, `position` or `none` (a passive log)
    command_period: float  # [s], one control period
    episodes: tuple[Episode, ...]  # at least one, each of at least two samples
    # the `leo` record: robot, start pose, held base, noise, seed; empty for foreign bags
    metadata: Mapping[str, str]
    warnings: tuple[str, ...] = ()  # what a user should know about the data, one line each
    # `measured`, `absent`, or `made`: logged, but differences of the positions; where they are not
    # measured, `dq` is differentiated from `q`
    rates: str = 'measured'

    @property
    def name(self) -> str:
        return self.path.name

    @property
    def constants(self) -> Mapping[str, float]:
        """Constants of the robot that were known of this recording (a payload), by path."""
        text = self.metadata.get('constants', '{}')
        try:
            return {str(path): float(value) for path, value in json.loads(text).items()}
        except (ValueError, TypeError, AttributeError, RecursionError):
            raise UserError(
                f'{self.path}: its metadata says constants: {shown(text)}; '
                'expected {path: value} as JSON'
            ) from None

    @property
    def steps(self) -> Floats:
        return np.concatenate([np.diff(e.t) for e in self.episodes])

    @property
    def state_period(self) -> float:
        return float(np.median(self.steps))

    @property
    def held(self) -> bool:
        return str(self.metadata.get('held', '')).lower() == 'true'


Recordings = Sequence[Recording]
Span = tuple[float, float]  # begin and end of a stretch of time [s]


def sample_period(recordings: Iterable[Recording]) -> float:
    """Median time from state to state over all recordings [s]; NaN where there are none."""
    steps = [r.steps for r in recordings if r.episodes]
    return float(np.median(np.concatenate(steps))) if steps else float('nan')


def distinct(recordings: Iterable[Recording]) -> None:
    for first, second in itertools.combinations(recordings, 2):
        pairs = itertools.product(first.episodes, second.episodes)
        overlap = any(max(e.t[0], f.t[0]) < min(e.t[-1], f.t[-1]) for e, f in pairs)
        if first.sha256 == second.sha256 and overlap:
            raise UserError(
                f'{second.path} is the same bag as {first.path}; give each once, '
                'and hold out bags that nothing is learned from'
            )


def between(
    recording: Recording, begin: float | None = None, end: float | None = None
) -> Recording:
    """The part of a recording from `begin` to `end` [s], both included; None for an open end.

    Times count from the first state, and stay as they are; fewer than two samples are refused.
    """
    low, high = check(begin, end)
    found = [at_rows(e, (e.t >= low - 1e-9) & (e.t <= high + 1e-9)) for e in recording.episodes]
    parts = [e for e in found if len(e.t) > 1]
    if not parts:
        last = max(float(e.t[-1]) for e in recording.episodes)
        raise UserError(
            f'{recording.path} has no states from {low:g} to {high:g} s; it lasts {last:.2f} s'
        )
    return replace(recording, episodes=tuple(parts))


def check(begin: float | None, end: float | None) -> tuple[float, float]:
    """The two as numbers [s], 0 and infinity where open; refuse what encloses nothing."""
    low, high = 0.0 if begin is None else begin, np.inf if end is None else end
    if not (low >= 0 and high > low):
        raise UserError(f'from {low:g} to {high:g} s is no time; give --from before --to, from 0')
    return low, high


def kept(recording: Recording, out: Sequence[Span], least: float) -> Recording | None:
    """A recording less stretches of time, and pieces shorter than `least` [s]; None if empty."""
    begins = [-np.inf, *(end for _, end in out)]
    ends = [*(begin for begin, _ in out), np.inf]
    pieces = [
        at_rows(e, (e.t > begin) & (e.t < end))
        for e in recording.episodes
        for begin, end in zip(begins, ends, strict=True)
    ]
    left = tuple(p for p in pieces if len(p.t) > 1 and p.t[-1] - p.t[0] >= least)
    return replace(recording, episodes=left) if left else None


def merged(stretches: Iterable[Span], within: float) -> tuple[Span, ...]:
    out: list[Span] = []
    for begin, end in sorted(stretches):
        if out and begin - out[-1][1] < within:
            out[-1] = (out[-1][0], max(end, out[-1][1]))
        else:
            out.append((begin, end))
    return tuple(out)


def by_rate(recordings: Iterable[Recording]) -> list[Recording]:
    """The recordings; one whose episodes come at several rates as one recording for each.

    What was logged at another rate has another noise and command period.
    """
    return [part for recording in recordings for part in _parts(recording)]


def _parts(recording: Recording) -> list[Recording]:
    first: list[Episode] = []
    for e in recording.episodes:
        if e.seconds >= LEAST and not any(_alike(e, other) for other in first):
            first.append(e)
    if len(first) < 2:
        return [recording]
    parts: list[list[Episode]] = [[] for _ in first]
    for e in recording.episodes:
        number = next((k for k, other in enumerate(first) if _alike(e, other)), 0)
        parts[number].append(e)
    return [_part(recording, number, episodes) for number, episodes in enumerate(parts)]


def _alike(a: Episode, b: Episode) -> bool:
    """Whether the usual step of one is among the middle half of the other's, or near it."""
    low, usual, high = np.quantile(np.diff(a.t), (0.25, 0.5, 0.75))
    least, other, most = np.quantile(np.diff(b.t), (0.25, 0.5, 0.75))
    return bool(low / NEAR <= other <= high * NEAR or least / NEAR <= usual <= most * NEAR)


def _part(recording: Recording, number: int, episodes: list[Episode]) -> Recording:
    """The episodes of one rate; a command with each state is one with each state of theirs."""
    part = replace(recording, episodes=tuple(episodes))
    period, whole = part.state_period, recording.state_period
    path = recording.path.with_name(f'{recording.name} (part {number + 1}, {1 / period:.4g} Hz)')
    of_all = recording.command_period
    told = [w for w in recording.warnings if not w.endswith('gaps; split there')]
    return replace(
        part,
        path=path,
        command_period=period if whole / NEAR < of_all < whole * NEAR else of_all,
        warnings=tuple(w.replace(str(recording.path), str(path), 1) for w in told if not number),
    )
