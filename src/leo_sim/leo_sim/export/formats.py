# SPDX-License-Identifier: Apache-2.0
"""The formats that `leo export` writes."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Format:
    name: str  # as it is called, in `held.SPEAKS` and in `files.TREES`
    ending: str  # of its files
    version: str  # what it was written for


FORMATS = {
    'mjcf': Format('MJCF', '.xml', 'MuJoCo 3.3 (delays 3.5, drag 3.7, goal rates 3.12) to 3.17'),
    'urdf': Format('URDF', '.urdf', 'URDF 1.0, as ROS 2 Jazzy reads it'),
    'sdf': Format('SDF', '.sdf', 'SDFormat 1.11, Gazebo Harmonic with its engine DART'),
    'isaaclab': Format(
        'Isaac Lab',
        '.py',
        'Isaac Lab 2.3 on Isaac Sim 5.1; before Isaac Sim 5.0 friction was a coefficient without '
        'unit, of the force in the joint, and dynamic and viscous friction did nothing',
    ),
}
"""By what `--to` takes."""
