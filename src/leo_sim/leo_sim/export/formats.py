# SPDX-License-Identifier: Apache-2.0
"""The formats that `leo export` writes, and whole files of them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
import re
from xml.etree import ElementTree

from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import visible
from leo_sim.export.held import Held, held
from leo_sim.export.isaac_lab import isaac_lab
from leo_sim.export.mjcf import mjcf
from leo_sim.export.sdf import sdf
from leo_sim.export.urdf import urdf
from leo_sim.model.model import Model


@dataclass(frozen=True)
class Format:
    name: str  # as it is called, and in `held.SPEAKS`
    ending: str  # of its files
    version: str  # what it was written for
    tree: Callable[[Model], ElementTree.Element] | None = None  # what writes it, where it is XML


FORMATS = {
    'mjcf': Format('MJCF', '.xml', 'MuJoCo 3.3 and later, tried with 3.17', mjcf),
    'urdf': Format('URDF', '.urdf', 'URDF 1.0, as ROS 2 Jazzy reads it', urdf),
    'sdf': Format('SDF', '.sdf', 'SDFormat 1.11, Gazebo Harmonic with its engine DART', sdf),
    'isaaclab': Format(
        'Isaac Lab',
        '.py',
        'Isaac Lab 2.3 on Isaac Sim 5.1; before Isaac Sim 5.0 friction was a coefficient without '
        'unit, of the force in the joint, and dynamic and viscous friction did nothing',
    ),
}
"""By what `--to` takes."""


@dataclass(frozen=True)
class Export:
    held: Held  # what of the model is in it
    texts: dict[Path, str]  # of each file; the first is the one that was asked for


def export(model: Model, ref: str, format_: Format, output: Path) -> Export:
    """A model in a format, to be written to `output` and, for Isaac Lab, to a URDF beside it.

    UserError: the format holds no such robot, or nothing has its inertial figures.
    """
    try:
        return _export(model, ref, format_, output)
    except UserError as error:
        raise UserError(f'{ref}: {error}') from error


def _export(model: Model, ref: str, format_: Format, output: Path) -> Export:
    found = held(model, format_.name)
    said = [
        f'Made from {ref} by leo export, for {format_.version}.',
        *(f'Left out: {line}.' for line in found.left_out),
    ]
    if format_.tree is not None:
        return Export(found, {output: _xml(format_.tree(found.model), said)})
    beside = output.with_suffix('.urdf')
    program = isaac_lab(found.model, beside.name)
    tree = urdf(found.model, dynamics=False)
    of_urdf = [f'Its joints and motors are in {output.name} beside it.', *said]
    return Export(found, {output: _python(program, said), beside: _xml(tree, of_urdf)})


def _xml(root: ElementTree.Element, said: list[str]) -> str:
    """A file: what it is, what it lacks, and the description."""
    ElementTree.indent(root)
    remark = re.sub('-(?=-)', '- ', visible('\n'.join(said)))
    body = ElementTree.tostring(root, encoding='unicode')
    return f'<?xml version="1.0"?>\n<!--\n{remark}\n-->\n{body}\n'


def _python(program: str, said: list[str]) -> str:
    """A program after a remark; its first two lines, where Python looks for a coding, are ours."""
    lines = visible('\n'.join(said)).splitlines()
    remark = ''.join(f'# {line}\n' for line in lines)
    return f'# An articulation for Isaac Lab.\n#\n{remark}\n{program}'
