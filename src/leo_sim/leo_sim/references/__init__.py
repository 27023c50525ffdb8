# SPDX-License-Identifier: Apache-2.0
"""Independent integrators of the same laws."""

from typing import Any

from leo_msgs_py.errors import UserError


def load_mujoco(what: str) -> Any:
    """The module that imports mujoco, which need not be installed; `what` is for the error."""
    try:
        from leo_sim.references import mujoco as module
    except ModuleNotFoundError as error:
        raise UserError(
            f"{what} needs the package mujoco: pip install 'mujoco>=3.12,<4'"
        ) from error
    return module
