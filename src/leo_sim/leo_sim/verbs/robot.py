# SPDX-License-Identifier: Apache-2.0
"""`leo robot`: make a robot folder from a URDF or MJCF, measure its step; list named robots."""

from __future__ import annotations

import json
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from leo_msgs_py.terminal import leo
from leo_msgs_py.verbs import common

if TYPE_CHECKING:
    from leo_sim.description.robot import Robot
    from leo_sim.verbs.skeleton.folder import Skeleton

INIT = """\
  leo robot init arm.urdf -o arm
  leo robot init arm.urdf -o arm --input voltage   # motors that take volts
  leo robot init arm.urdf -o arm --input position  # servos that take goals
  leo robot init arm.xml -o arm                    # an MJCF
  leo robot init arm.urdf -o arm --driver dynamixel
  leo robot init arm.urdf -o arm --without gripper  # and all beyond that link
"""
KINDS, BUSES = ('torque', 'voltage', 'position'), ('dynamixel', 'feetech')
STEP, LIST = '  leo robot step arm\n', '  leo robot list\n'


def main(argv: list[str]) -> int:
    about = 'Make a robot folder from a URDF or MJCF; measure its integration step; list robots.'
    verbs = {'init': _init, 'step': _step, 'list': _list}
    return common.dispatch('leo robot', about, verbs, argv, INIT + STEP + LIST)


def _init(argv: list[str]) -> int:
    about = 'Make a robot folder from a URDF or MJCF and say what is left to fill in.'
    parser = common.Parser('leo robot init', about, INIT)
    parser.add_argument('urdf', type=Path, metavar='URDF|MJCF')
    parser.add_argument('-o', '--output', type=Path, required=True, metavar='FOLDER')
    parser.add(
        '--input', "what the actuators take (default: torque, or as the MJCF's)", choices=KINDS
    )
    parser.add('--driver', 'write how its hardware is connected, to be filled in', choices=BUSES)
    parser.add(
        '--without LINK',
        'take this link out, with its joint and everything beyond it',
        action='append',
        default=[],
    )
    options = parser.parse_args(argv)

    from leo_sim.verbs.skeleton.folder import make_folder

    made = make_folder(
        options.urdf, options.output, options.input or '', options.driver, options.without
    )
    following = leo('compare', 'BAG', '--model', options.output)
    if options.json:
        found = {
            'folder': str(options.output),
            **_facts(made.robot),
            'integration_step': made.robot.integration_step,
            'left_to_fill_in': made.open,
            'notes': made.notes,
            'warnings': made.doubts,
            'next': following,
        }
        print(json.dumps(found, indent=2))
    else:
        print('\n'.join([*_said(made, options.output), f'next: {following}']))
    return 0


def _step(argv: list[str]) -> int:
    about = 'Measure the integration step of a robot folder and write it there.'
    parser = common.Parser('leo robot step', about, STEP)
    parser.add_argument('folder', type=Path, metavar='FOLDER')
    options = parser.parse_args(argv)

    from leo_sim.verbs.skeleton.figures import measure_step

    before, after, error = measure_step(options.folder)
    data = {'folder': str(options.folder), 'before': before, 'integration_step': after}
    common.show(
        options,
        data,
        [
            f'integration step {before:g} -> {after:g} s: one control period is off by '
            f'{100 * error:.1g} % of its change of speed',
            f'wrote {options.folder}/robot.yaml',
        ],
    )
    return 0


def _list(argv: list[str]) -> int:
    parser = common.Parser('leo robot list', 'The robots and models that have a name.', LIST)
    options = parser.parse_args(argv)

    from leo_sim.description.robot import load_robot, named_robots
    from leo_sim.model.model_file import named_models

    robots = [load_robot(name) for name in sorted(named_robots())]
    lines = [f'{r.name}: {", ".join(r.joint_names)} ({r.input}, {r.base} base)' for r in robots]
    lines.append(f'models by name: {", ".join(sorted(named_models()))}')
    common.show(options, [_facts(robot) for robot in robots], lines)
    return 0


def _facts(robot: Robot) -> dict[str, object]:
    limits = {a.joint: a.limit for a in robot.actuators}
    joints = list(robot.joint_names)
    return {'name': robot.name, 'joints': joints, 'input': robot.input, 'limits': limits}


def _said(made: Skeleton, folder: Path) -> list[str]:
    robot = made.robot
    limits = {joint.name: joint.limits for joint in robot.joints}
    start = robot.start_poses['nominal'].angles
    lines = [
        f'wrote {folder}/robot.urdf and {folder}/robot.yaml: {robot.name}, '
        f'{len(robot.joint_names)} joints'
    ]
    for a in robot.actuators:
        low, high = limits[a.joint]
        unit = robot.constants[f'actuators.{a.joint}.limit'].unit
        angle = 'm' if a.joint in robot.slides else 'rad'
        ends = f'from {low:.4g} to {high:.4g} {angle}' if isfinite(high - low) else 'without stops'
        begins = f'starts at {start[a.joint]:.4g} {angle}'
        lines.append(f'  {a.joint}: {ends}, {begins}, takes up to {a.limit:g} {unit}')
    copies = (j for j in robot.joints if j.leader)
    lines += [f'  {j.name}: moves with {j.leader}, {j.ratio:g} times as far' for j in copies]
    lines.append(f'integration step {robot.integration_step:g} s')
    lines += [f'warning: {doubt}' for doubt in made.doubts]
    lines += [f'note: {note}' for note in made.notes]
    lines.append(f'left to fill in (FILL IN in {folder}/robot.yaml):')
    return [*lines, *(f'  - {sentence}' for sentence in made.open)]
