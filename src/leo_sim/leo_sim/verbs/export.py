# SPDX-License-Identifier: Apache-2.0
"""`leo export`: write a model as MJCF or URDF, and say what is not in it."""

from __future__ import annotations

import json
from pathlib import Path
import re
import shlex
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo, visible
from leo_msgs_py.verbs.common import Parser
from leo_msgs_py.whole_file import write_whole
from leo_sim.effects.consent import add_effect_argument

if TYPE_CHECKING:
    from leo_sim.model.model import Model

EXAMPLES = """\
  leo export repaired.yaml -o repaired.xml     # MJCF, for MuJoCo
  leo export repaired.yaml -o repaired.urdf
  leo export so101_bam -o so101.xml --json
"""
FORMATS = {'.xml': 'MJCF', '.urdf': 'URDF'}


def main(argv: list[str]) -> int:
    """Write a model as URDF or MJCF and say what is not in it; exit status 0."""
    parser = Parser(
        'leo export', 'Write a model as URDF or MJCF, and say what is not in it.', EXAMPLES
    )
    parser.add_argument(
        'model', metavar='MODEL', help='a model file, a robot name or a robot folder'
    )
    parser.add_argument(
        '-o',
        dest='output',
        type=Path,
        required=True,
        metavar='FILE',
        help='a new file: FILE.xml is MJCF, FILE.urdf is URDF',
    )
    add_effect_argument(parser)
    parser.add_json()
    options = parser.parse_args(argv)
    output: Path = options.output
    if output.suffix not in FORMATS:
        raise UserError(
            f'{output}: a name that ends with .urdf or with .xml (MJCF) says which format'
        )
    if output.exists():
        raise UserError(f'{output} exists; choose a new file')

    from leo_sim.export.held import held
    from leo_sim.model.model_file import load_model

    format_name = FORMATS[output.suffix]
    found = held(load_model(options.model), format_name)
    write_whole(output, _document(found.model, format_name, options.model, found.left_out))
    follows = leo('robot', 'init', output, '-o', 'FOLDER')
    if format_name == 'MJCF':
        follows = shlex.join(['python', '-m', 'mujoco.viewer', f'--mjcf={output}'])
    if options.json:
        data = {
            'file': str(output),
            'format': format_name,
            'effects': found.effects,
            'left_out': found.left_out,
            'next': follows,
        }
        print(json.dumps(data, indent=2))
        return 0
    print(f'wrote {output}: {found.model.robot.name} as {format_name}')
    for line in found.effects:
        print(f'holds {line}')
    for line in found.left_out:
        print(f'left out: {line}')
    print(f'next: {follows}')
    return 0


def _document(model: Model, format_name: str, ref: str, left_out: tuple[str, ...]) -> str:
    """The file: what it is, what it lacks, and the description."""
    from leo_sim.export.formats import mjcf, urdf

    root = (mjcf if format_name == 'MJCF' else urdf)(model)
    ElementTree.indent(root)
    said = [f'Made from {ref} by leo export.', *(f'Left out: {line}.' for line in left_out)]
    remark = re.sub('-(?=-)', '- ', visible('\n'.join(said)))
    body = ElementTree.tostring(root, encoding='unicode')
    return f'<?xml version="1.0"?>\n<!--\n{remark}\n-->\n{body}\n'
