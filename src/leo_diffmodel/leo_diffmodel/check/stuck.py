# SPDX-License-Identifier: Apache-2.0
"""Sensors that stand still, or at their end, while the other one says that the joint moves."""

from __future__ import annotations

from itertools import groupby

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import ERROR, Finding, times
from leo_diffmodel.outside.frozen import Frozen, frozen

TODO = {
    False: 'encoder or bus lost samples: mend it, or leave these stretches out',
    True: 'beyond its range: record slower, or a smaller swing, or leave these stretches out',
}


def stuck(recording: Recording) -> list[Finding]:
    """One finding per joint and sensor that got stuck or came to its end."""
    groups = groupby(frozen(recording), lambda f: (f.joint, f.sensor, f.at_end))
    return [_finding(list(group)) for _, group in groups]


def _finding(found: list[Frozen]) -> Finding:
    first, where = found[0], tuple((f.begin, f.end) for f in found)
    what = f'{first.joint}: its {first.sensor} {first.how} while the joint moves: {times(where)}'
    code = 'clipped' if first.at_end else 'stuck'
    return Finding(code, ERROR, what, where, TODO[first.at_end])
