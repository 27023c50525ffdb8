# SPDX-License-Identifier: Apache-2.0
"""Is the speed the derivative of the angle? Its scale and its lag, joint by joint."""

from __future__ import annotations

from itertools import chain

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import ERROR, Finding, OK, WARNING
from leo_diffmodel.outside.rate import Rate, relate

SURE = 5.0
SCALE_OFF = 0.03
LAG_OFF = 0.002
LAG_PERIODS = 0.5
"""What happens between two samples, as after a step of the voltage, looks like a lag so long."""


def rates(recording: Recording) -> list[Finding]:
    """One finding per joint that moves enough to tell."""
    if recording.rates != 'measured':
        return []
    found = [(n, relate(recording, j)) for j, n in enumerate(recording.joints)]
    return list(chain.from_iterable(_judged(n, r) for n, r in found if r is not None))


def _judged(joint: str, rate: Rate) -> list[Finding]:
    scale, lag = rate.scale, rate.lag
    out = []
    if abs(scale[0] - 1) > max(SCALE_OFF, SURE * scale[1]):
        what = (
            f'{joint}: the angle changes {scale[0]:.3f} ± {2 * scale[1]:.3f} times as much as '
            'the measured speed says'
        )
        todo = 'one of the two has the wrong unit or gear ratio: check the driver'
        out.append(Finding('rate_scale', ERROR, what, (), todo))
    if abs(lag[0]) > max(LAG_OFF, LAG_PERIODS * rate.period) + SURE * lag[1]:
        late = 'late' if lag[0] > 0 else 'early'
        what = (
            f'{joint}: the speed is {abs(1e3 * lag[0]):.1f} ± {2e3 * lag[1]:.1f} ms {late} '
            'against the angle'
        )
        todo = 'a filter in the driver? explain tries velocity_lag; else record the raw speed'
        out.append(Finding('rate_lag', WARNING, what, (), todo))
    if not out:
        what = f'{joint}: the speed is the derivative of the angle (scale {scale[0]:.3f})'
        out.append(Finding('rate', OK, what))
    return out
