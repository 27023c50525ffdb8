# SPDX-License-Identifier: Apache-2.0
"""What was left out because something else than the robot moved it."""

from __future__ import annotations

from collections.abc import Sequence

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.outside.outside import moved_from_outside, share_outside, Stretch
from leo_diffmodel.report.page import Section
from leo_diffmodel.report.text import numbered, percent
from leo_sim.model import Model


def section(recordings: Sequence[Recording], model: Model) -> Section:
    """Every stretch of the recordings with its bag, times and reason, by the model as given."""
    found = moved_from_outside(recordings, model)
    numbers = numbered(recordings)
    values = {
        'share': percent(share_outside(recordings, found)),
        'rows': [_row(s, numbers[s.source]) for s in found],
        'several': len(recordings) > 1,
    }
    return Section('outside.html', values)


def _row(stretch: Stretch, bag: str) -> dict[str, str]:
    time = f'{max(0.0, stretch.begin):.1f} … {stretch.end:.1f}\u00a0s'
    return {'bag': bag, 'time': time, 'kind': stretch.kind, 'why': stretch.why}
