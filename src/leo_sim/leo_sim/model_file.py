# SPDX-License-Identifier: Apache-2.0
"""`load_model` and `save_model` where programs outside this project import them from."""

from leo_sim.model.model_file import load_model, save_model

__all__ = ['load_model', 'save_model']
