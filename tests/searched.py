# SPDX-License-Identifier: Apache-2.0
"""A search on recordings in memory, without the sentence and the tables of an answer."""

from collections.abc import Sequence

import pytest

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.explain.select import search as selection
from leo_diffmodel.explain.select.search import Search, search
from leo_diffmodel.explain.settings import SETTINGS, Settings
from leo_sim.model import Model


def searched(
    data: Sequence[Recording],
    model: Model,
    settings: Settings = SETTINGS,
    hold_out: Sequence[Recording] = (),
) -> Search:
    """What is chosen from all effects of the catalogue."""
    return search([*data, *hold_out], model, pose(data, hold_out, model, settings))


def among(patch: pytest.MonkeyPatch, model: Model, *names: str) -> None:
    """Let every search choose from these effects alone, in this order."""
    pool = [c for name in names for c in candidates(model) if c.effect.name == name]
    patch.setattr(selection, 'seen', lambda *_: pool)
