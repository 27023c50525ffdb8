# SPDX-License-Identifier: Apache-2.0
"""The integration step of a robot folder, measured again once its figures are filled in."""
from pathlib import Path
import re

from leo_msgs_py.errors import UserError
from leo_msgs_py.whole_file import write_whole
from leo_sim.common.yaml_file import read_text
from leo_sim.description.robot import load_robot
from leo_sim.verbs.skeleton.implied_figures import integration_step

LINE = re.compile(r'^integration_step:.*$', re.MULTILINE)


def measure_step(folder: Path) -> tuple[float, float, float]:
    """Write the longest step that keeps a control period exact into robot.yaml.

    Returns:
        The step before and now [s], and the error that it leaves, as `integration_step`.

    Raises:
        UserError: No robot folder, or a robot on the ground, whose steps are of its contacts.
    """
    if not folder.is_dir():
        raise UserError(f'{folder} is no robot folder; leo robot step takes one of yours')
    robot = load_robot(folder)
    if robot.contacts:
        raise UserError(f'{folder}: the step of a robot on the ground is that of its contacts; '
                        'docs/leo_physics.md says how it is chosen')
    step, error = integration_step(robot)
    line = (f'integration_step: {step:g}  # s; one control period is off by {100 * error:.1g} % '
            'of its change of speed')
    text = read_text(folder / 'robot.yaml')
    write_whole(folder / 'robot.yaml', LINE.sub(line, text))
    return robot.integration_step, step, error
