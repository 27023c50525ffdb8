# SPDX-License-Identifier: Apache-2.0
"""The first round of the search alone: every effect against the model as given."""

from collections.abc import Sequence
from unittest import mock

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.explain.select import engine
from leo_diffmodel.explain.select.search import Search
from leo_sim.model import Model


def first_search(data: Sequence[Recording], model: Model) -> Search:
    """A search that stops after its first round."""
    with mock.patch.object(engine, 'MOST_EFFECTS', 0):
        return engine.search(data, [], model)
