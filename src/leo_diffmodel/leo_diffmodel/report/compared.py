# SPDX-License-Identifier: Apache-2.0
"""The report of `leo compare`."""

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare.comparison import Comparison
from leo_diffmodel.report.page import render
from leo_diffmodel.report.sections import budget, horizon, missing, origin, verdict, where
from leo_diffmodel.report.text import source
from leo_diffmodel.report.worst import stretches
from leo_sim.model import Model


def comparison_page(
    comparison: Comparison, recordings: Recordings, model: Model, watch: str = ''
) -> str:
    """The report of `leo compare`; `watch` opens the live page on the same data, '' names none."""
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
    return render(f'{robot.name}: model against data', source(recordings), sections, watch)
