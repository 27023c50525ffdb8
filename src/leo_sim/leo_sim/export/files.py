# SPDX-License-Identifier: Apache-2.0
"""Whole files of a model in a format of `formats`."""

from dataclasses import dataclass
from pathlib import Path
import re
from xml.etree import ElementTree

from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import visible
from leo_sim.export.formats import Format
from leo_sim.export.held import Held, held
from leo_sim.export.isaac_lab import isaac_lab
from leo_sim.export.mjcf import mjcf
from leo_sim.export.sdf import sdf
from leo_sim.export.urdf import urdf
from leo_sim.model.model import Model

TREES = {'MJCF': mjcf, 'URDF': urdf, 'SDF': sdf}
"""What writes a format that is XML."""


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
    if format_.name in TREES:
        return Export(found, {output: _xml(TREES[format_.name](found.model), said)})
    beside = output.with_suffix('.urdf')
    program = isaac_lab(found.model, beside.name)
    tree = urdf(found.model, dynamics=False)
    of_urdf = [f'Its joints and motors are in {output.name} beside it.', *said]
    return Export(found, {output: _python(program, said), beside: _xml(tree, of_urdf)})


def _xml(root: ElementTree.Element, said: list[str]) -> str:
    ElementTree.indent(root)
    remark = re.sub('-(?=-)', '- ', visible('\n'.join(said)))
    body = ElementTree.tostring(root, encoding='unicode')
    return f'<?xml version="1.0"?>\n<!--\n{remark}\n-->\n{body}\n'


def _python(program: str, said: list[str]) -> str:
    """A program after a remark; its first two lines, where Python looks for a coding, are ours."""
    remark = ''.join(f'# {line}\n' for line in visible('\n'.join(said)).splitlines())
    return f'# An articulation for Isaac Lab.\n#\n{remark}\n{program}'
