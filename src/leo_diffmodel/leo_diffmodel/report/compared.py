# SPDX-License-Identifier: Apache-2.0
"""The report of `leo compare`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.comparison import Comparison
from leo_diffmodel.report import page
from leo_diffmodel.report.sections import budget, horizon, missing, origin, verdict, where
from leo_diffmodel.report.worst import stretches
from leo_sim.model import Model


def write_comparison(
    path: Path,
    comparison: Comparison,
    recordings: Sequence[Recording],
    model: Model,
    watch: str = '',
) -> None:
    """Write the report of `leo compare`.

    Args:
        path: the HTML file; replaced whole or not at all.
        comparison: the result.
        recordings: what it was computed from.
        model: the model that was compared.
        watch: the command that opens the live page on the same data; '' names none.
    """
    data, robot = comparison.data, model.robot
    worst = stretches([comparison.prediction])
    sections = [
        verdict.score(data),
        budget.measured(data['budget']),
        where.section(comparison.where, model, recordings, worst),
        missing.section(comparison.missing, robot),
        horizon.plain(data),
        origin.section(data['provenance'], recordings, data['seconds']),
    ]
    title = f'{robot.name}: model against data'
    page.write(path, page.render(title, page.source(recordings), sections, watch))
