# SPDX-License-Identifier: Apache-2.0
"""From evidence to a verdict and the sentence a person reads first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.compare.noise import per_window
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.estimate.fit import Fit
from leo_diffmodel.explain.select.scored import dispersion, unexplained

LEAST_WINDOWS = 12
LEAST_SIGMAS = 8.0
UNEXPLAINED_RATIO = 1.6
UNEXPLAINED_SHARE = 0.25
CORRELATED_RATIO, CORRELATED = 1.3, 1.5
FAR_RATIO = 4.0
"""More than that left on the ground is not all, however much was explained."""
AT_TIMES, FEWEST = 0.85, 4
"""Quantile of windows: a law that acts in a sixth of them is seen; contacts that flip make up
less (ten runs of LEO without an effect: at most 1.15 times the noise here). And how many windows
are above it at least: a push is not to decide."""


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


@dataclass(frozen=True)
class Rest:
    """What the supported effects leave.

    Attributes:
        ratio: mean squared whitened residual over its expected value, in the median window; on
            the ground in one worse than most, see `rest_of`.
        share: of the model's error (beyond noise) that is left.
        correlation: times by which correlation in time makes what is left less than it seems;
            1 for white noise.
        on_ground: of a robot with contacts.
    """

    ratio: float
    share: float
    correlation: float = 1.0
    on_ground: bool = False

    @property
    def matters(self) -> bool:
        """Whether it is more than noise and a good part of what was missing, or far more."""
        if self.on_ground and self.ratio > FAR_RATIO:
            return True
        correlated = self.ratio > CORRELATED_RATIO and self.correlation > CORRELATED
        return self.share > UNEXPLAINED_SHARE and (self.ratio > UNEXPLAINED_RATIO or correlated)


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


def rest_of(null: Fit, final: Fit, on_ground: bool = False) -> Rest:
    """What the effects of a fit leave of the error of the model without them.

    On the ground no law is looked for in what does not matter, so this must see one that acts at
    times only: a cable that is slack in most windows.

    Args:
        null: the fit without the effects.
        final: the fit with them.
        on_ground: of a robot with contacts.
    """
    windows = len(final.residual)
    quantile = max(0.5, min(AT_TIMES, 1.0 - FEWEST / windows)) if on_ground else 0.5
    before, ratio = (unexplained(f, quantile) for f in (null, final))
    correlation = dispersion(final) / max(1.0, unexplained(final))
    return Rest(ratio, share_left(before, ratio), correlation, on_ground)


def decide(named: Sequence[Named], rest: Rest, outside: bool = False) -> str:
    """fine, named, ambiguous or unknown.

    Args:
        named: the supported effects.
        rest: what they leave.
        outside: one variable explains more than the known effects do.
    """
    if outside or rest.matters:
        return 'unknown'
    if not named:
        return 'fine'
    return 'ambiguous' if any(n.rivals for n in named) else 'named'


def sentence(
    verdict: str,
    named: Sequence[Named],
    change: str,
    note: str | None = None,
    outside: str | None = None,
) -> str:
    """One or two plain sentences.

    Args:
        verdict: of `decide`.
        named: the supported effects.
        change: how the held-out error changed, in words.
        note: what the named effects could also be, in words.
        outside: the law that is no known effect, in words.
    """
    if note:
        change = f'{change} ({note})'
    listed = '; '.join(_describe(n) for n in named)
    if verdict == 'fine':
        return f'Nothing is missing that this data can show: {change}.'
    if verdict == 'unknown':
        return _unknown(listed, change, outside)
    if verdict == 'ambiguous':
        return f'Something is missing that this data cannot pin down: {listed}; {change}.'
    return f'Missing: {listed}; {change}.'


def _unknown(listed: str, change: str, outside: str | None) -> str:
    rest = f': {outside}' if outside else ''
    if not listed and outside:
        return f'Something is missing, and none of the known effects is it{rest}.'
    if not listed:
        return f'Something is missing, and none of the known effects is it: {change}.'
    return f'Part of what is missing is {listed}: {change}. The rest is no known effect{rest}.'


def _describe(named: Named) -> str:
    text = f'{named.label} ({named.text})'
    if named.together:
        text += f', which is the same thing in this data as {_either(named.together)}'
    if named.rivals:
        text += f', or {_either(named.rivals)}'
    return text


def _either(labels: Sequence[str]) -> str:
    return ' or '.join(labels)
