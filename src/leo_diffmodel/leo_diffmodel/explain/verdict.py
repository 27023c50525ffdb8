# SPDX-License-Identifier: Apache-2.0
"""From evidence to a verdict and the sentence a person reads first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.compare.noise import per_window
from leo_diffmodel.compare.windows import Windows

LEAST_WINDOWS = 12
LEAST_SIGMAS = 8.0
UNEXPLAINED_RATIO = 1.6
UNEXPLAINED_SHARE = 0.25


@dataclass(frozen=True)
class Named:
    """One effect as the sentence says it.

    Attributes:
        label: effect:where.
        text: parameters with units and intervals.
        together: labels of the same thing in the data.
        rivals: labels that this data cannot rule out.
    """

    label: str
    text: str
    together: tuple[str, ...] = ()
    rivals: tuple[str, ...] = ()


def untestable(windows: Windows, sigma: np.ndarray) -> str | None:
    """Why the data cannot say anything, and what to record instead; None where they can."""
    if windows.count < LEAST_WINDOWS:
        seconds = float(windows.dt.sum())
        return (
            f'only {seconds:.1f} s of data in {windows.count} windows: '
            'record 20 s or more with a changing input'
        )
    joints = windows.q.shape[-1]
    noise = per_window(sigma, windows)[:, 0]
    swing = np.ptp(windows.q, axis=1) / noise[:, :joints]
    speed = np.ptp(windows.dq, axis=1) / noise[:, joints:]
    moving = np.maximum(swing, speed).max(axis=-1) > LEAST_SIGMAS
    if moving.sum() < LEAST_WINDOWS:
        return (
            f'the robot hardly moves ({moving.sum()} of {windows.count} windows above the noise): '
            'record 20 s with an input that swings it, such as steps of random size'
        )
    return None


def share_left(before: float, after: float) -> float:
    """Share of the model's error beyond noise that the named effects leave, 0 to 1.

    Args:
        before: mean squared whitened residual over its expected value, model as given.
        after: the same with the effects.
    """
    return float(np.clip((after - 1.0) / max(before - 1.0, 1e-9), 0.0, 1.0))


def decide(named: Sequence[Named], ratio: float, share: float) -> str:
    """fine, named, ambiguous or unknown.

    Args:
        named: the supported effects.
        ratio: mean squared whitened residual over its expected value.
        share: of the model's error (beyond noise) that is left after the effects.
    """
    left = ratio > UNEXPLAINED_RATIO and share > UNEXPLAINED_SHARE
    if left:
        return 'unknown'
    if not named:
        return 'fine'
    return 'ambiguous' if any(n.rivals for n in named) else 'named'


def sentence(
    verdict: str, named: Sequence[Named], change: str, note: str | None = None
) -> str:
    """One or two plain sentences.

    Args:
        verdict: of `decide`.
        named: the supported effects.
        change: how the held-out error changed, in words.
        note: what the named effects could also be, in words.
    """
    if note:
        change = f'{change} ({note})'
    listed = '; '.join(_describe(n) for n in named)
    if verdict == 'fine':
        return f'Nothing is missing that this data can show: {change}.'
    if verdict == 'unknown' and not named:
        return f'Something is missing, and none of the known effects is it: {change}.'
    if verdict == 'unknown':
        return f'Part of what is missing is {listed}: {change}. The rest is no known effect.'
    if verdict == 'ambiguous':
        return f'Something is missing that this data cannot pin down: {listed}; {change}.'
    return f'Missing: {listed}; {change}.'


def _describe(named: Named) -> str:
    text = f'{named.label} ({named.text})'
    if named.together:
        text += f', which is the same thing in this data as {_either(named.together)}'
    if named.rivals:
        text += f', or {_either(named.rivals)}'
    return text


def _either(labels: Sequence[str]) -> str:
    return ' or '.join(labels)
