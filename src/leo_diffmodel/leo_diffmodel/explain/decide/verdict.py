# SPDX-License-Identifier: Apache-2.0
"""From evidence to a verdict and the sentence a person reads first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.compare.noise import per_window
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.loss import dispersion, unexplained
from leo_diffmodel.explain.settings import SETTINGS, Settings

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
        doubt: why it is not sure; '' where it is.
    """

    label: str
    text: str
    together: tuple[str, ...] = ()
    rivals: tuple[str, ...] = ()
    doubt: str = ''

    @property
    def sure(self) -> bool:
        """Whether it can be named alone."""
        return not (self.rivals or self.doubt)


@dataclass(frozen=True)
class Rest:
    """What the supported effects leave.

    Attributes:
        ratio: mean squared whitened residual over its expected value, in the median window; on
            the ground in one worse than most, see `rest_of`.
        share: of the model's error (beyond noise) that is left.
        correlation: times by which correlation in time makes what is left less than it seems;
            1 for white noise.
        settings: the gates.
    """

    ratio: float
    share: float
    correlation: float = 1.0
    settings: Settings = SETTINGS

    @property
    def _is_correlated(self) -> bool:
        gates = self.settings
        return self.ratio > gates.correlated and self.correlation > gates.correlation

    @property
    def matters(self) -> bool:
        """Whether it is more than noise and a good part of what was missing, or far more."""
        if self.ratio > self.settings.far:
            return True
        correlated = self._is_correlated
        much = self.ratio > self.settings.unexplained or correlated
        return self.share > self.settings.share and much


def untestable(windows: Windows, sigma: np.ndarray) -> str | None:
    """Why the data cannot say anything, and what to record instead; None where they can."""
    if windows.count < SETTINGS.fewest_windows:
        seconds = float(windows.dt.sum())
        return (
            f'only {seconds:.1f} s of data in {windows.count} windows: '
            'record 20 s or more with a changing input'
        )
    joints = windows.q.shape[-1]
    noise = per_window(sigma, windows)[:, 0]
    swing = np.ptp(windows.q, axis=1) / noise[:, :joints]
    speed = np.ptp(windows.dq, axis=1) / noise[:, joints:]
    moving = np.maximum(swing, speed).max(axis=-1) > SETTINGS.least_motion
    if moving.sum() < SETTINGS.fewest_windows:
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


def rest_of(
    null: Fit, final: Fit, on_ground: bool = False, settings: Settings = SETTINGS
) -> Rest:
    """What the effects of a fit leave of the error of the model without them.

    On the ground no law is looked for in what does not matter, so this must see one that acts at
    times only: a cable that is slack in most windows.

    Args:
        null: the fit without the effects.
        final: the fit with them.
        on_ground: of a robot with contacts.
        settings: the gates.
    """
    windows = len(final.residual)
    quantile = max(0.5, min(AT_TIMES, 1.0 - FEWEST / windows)) if on_ground else 0.5
    before, ratio = (unexplained(f, quantile) for f in (null, final))
    correlation = dispersion(final) / max(1.0, unexplained(final))
    return Rest(ratio, share_left(before, ratio), correlation, settings)


def decide(named: Sequence[Named], rest: Rest, unknown: bool, doubts: Sequence[str] = (),
           more: bool = False) -> str:
    """fine, named, partly, ambiguous or unknown.

    Args:
        named: the supported effects.
        rest: what they leave.
        unknown: one law that is no known effect explains more, or somebody moved the robot.
        doubts: what keeps the whole answer from being sure.
        more: other effects are chosen beside these too often for these to be all.
    """
    if unknown or (rest.matters and not any(n.sure for n in named)):
        return 'unknown'
    if not named:
        return 'fine'
    if doubts or not all(n.sure for n in named):
        return 'ambiguous'
    return 'partly' if rest.matters or more else 'named'


def sentence(
    verdict: str,
    named: Sequence[Named],
    change: str,
    notes: Sequence[str] = (),
    outside: str | None = None,
    rest: str = '',
) -> str:
    """One or two plain sentences.

    Args:
        verdict: of `decide`.
        named: the supported effects.
        change: how the held-out error changed, in words.
        notes: doubts, and what the named effects could also be, in words.
        outside: the law that is no known effect, or who moved the robot, in words.
        rest: how much is left and where, in words.
    """
    if notes:
        change = f'{change} ({"; ".join(notes)})'
    listed = '; '.join(_describe(n) for n in named)
    if verdict == 'fine':
        return f'Nothing is missing that this data can show: {change}.'
    if verdict == 'unknown':
        return _unknown(listed, change, outside)
    if verdict == 'ambiguous':
        return f'Something is missing that this data cannot pin down: {listed}; {change}.'
    if verdict == 'partly':
        return f'Missing for sure: {listed}; {change}. {rest}.'
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
    if named.doubt:
        text += f', {named.doubt}'
    return text


def _either(labels: Sequence[str]) -> str:
    return ' or '.join(labels)
