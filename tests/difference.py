# SPDX-License-Identifier: Apache-2.0
"""Difference models that have learned nothing."""

from typing import Any

from leo_diffmodel.difference.data import layout_of
from leo_diffmodel.difference.model import DifferenceModel
from leo_diffmodel.difference.network import Config, Network
from leo_sim.model import Model
from leo_sim.model.physics import of_model


def untrained(model: Model, **changes: Any) -> DifferenceModel:
    """One with the first weights of a small network; it says over which model it is."""
    config, layout = Config(hidden=(4,), **changes), layout_of(model.robot)
    made = Network(layout, config).eval(), layout, config, model.robot.name, 1, 0
    return DifferenceModel(*made, over=of_model(model))
