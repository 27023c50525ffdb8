# SPDX-License-Identifier: Apache-2.0
"""Robots in folders of their own: of two texts, or like another but for what its files say."""

from pathlib import Path

from leo_sim.description.robot import load_robot, Robot


def made(folder: Path, urdf: str, figures: str) -> Robot:
    """The robot of a robot.urdf and a robot.yaml, which are written."""
    folder.mkdir(exist_ok=True)
    (folder / 'robot.urdf').write_text(urdf)
    (folder / 'robot.yaml').write_text(figures)
    return load_robot(folder)


def like(robot: Robot, folder: Path, *changes: tuple[str, str]) -> Robot:
    """The robot again, with other texts (old, new) in its files."""
    urdf, figures = ((robot.folder / f'robot.{kind}').read_text() for kind in ('urdf', 'yaml'))
    for old, new in changes:
        assert old in urdf + figures, old
        urdf, figures = urdf.replace(old, new), figures.replace(old, new)
    return made(folder, urdf, figures)
