# SPDX-License-Identifier: Apache-2.0
"""A robot with effects and constants: predicts one state, or many windows at once."""

from leo_sim.model.batch import History, rollout
from leo_sim.model.model import Model
from leo_sim.model.model_file import load_model, save_model
from leo_sim.model.state import State

__all__ = ['History', 'Model', 'State', 'load_model', 'rollout', 'save_model']
