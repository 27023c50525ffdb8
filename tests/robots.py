# SPDX-License-Identifier: Apache-2.0
"""The robots of the tests, and robots like another but for what their files say."""

from pathlib import Path

from tests.places import DATA

from leo_sim.description.robot import load_robot, Robot
from leo_sim.verbs.skeleton.folder import make_folder, Skeleton

CART = load_robot(DATA / 'cart')  # that a motor pushes along a level rail: its joint slides
CART_POLE = load_robot(DATA / 'cart_pole')  # the same with a pole that hangs from it
FLYWHEEL = load_robot(DATA / 'flywheel')  # a motor with a wheel, whose mass lies on the axis
ARM = load_robot(DATA / 'arm')  # three joints in space, the one in the middle slides
BALL = load_robot(DATA / 'ball')  # 3 kg on a sphere over the ground
SLIDES = (DATA / 'slides.urdf').read_text()  # two fingers that slide apart, one mimics the other
CLAW = (DATA / 'claw.urdf').read_text()
"""A thumb, a finger that goes the other way, its tip that bends half as far, a wheel on it."""


def made(folder: Path, urdf: str, figures: str) -> Robot:
    """The robot of a robot.urdf and a robot.yaml, which are written."""
    folder.mkdir(exist_ok=True)
    (folder / 'robot.urdf').write_text(urdf)
    (folder / 'robot.yaml').write_text(figures)
    return load_robot(folder)


def skeleton_of(text: str, folder: Path, kind: str = 'torque', *more, **without) -> Skeleton:
    """What `leo robot init` makes of a URDF or MJCF, in the folder `robot` beside it."""
    folder.mkdir(exist_ok=True)
    (folder / 'file.xml').write_text(text)
    return make_folder(folder / 'file.xml', folder / 'robot', kind, *more, **without)


def like(robot: Robot, folder: Path, *changes: tuple[str, str]) -> Robot:
    """The robot again, with other texts (old, new) in its files."""
    urdf, figures = ((robot.folder / f'robot.{kind}').read_text() for kind in ('urdf', 'yaml'))
    for old, new in changes:
        assert old in urdf + figures, old
        urdf, figures = urdf.replace(old, new), figures.replace(old, new)
    return made(folder, urdf, figures)
