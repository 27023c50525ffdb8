# SPDX-License-Identifier: Apache-2.0
"""leo export: write a model for another simulator, say what is not in it, and what that costs."""

from __future__ import annotations

from argparse import Namespace
import json
from pathlib import Path
import shlex
from typing import Any, TYPE_CHECKING

from leo_diffmodel.verbs import common
from leo_msgs_py.console import figures, progress, Table, Terminal
from leo_msgs_py.ending import told_when_ended
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.verbs.common import Parser
from leo_msgs_py.whole_file import write_together
from leo_sim.common.consent import add_effect_argument
from leo_sim.export.formats import Format, FORMATS

if TYPE_CHECKING:
    from leo_sim.export.files import Export
    from leo_sim.model import Model

EXAMPLES = (
    'leo export repaired.yaml --to mjcf          # repaired.xml, for MuJoCo',
    'leo export repaired.yaml -o arm.sdf         # SDF, for Gazebo; .urdf is URDF',
    'leo export repaired.yaml --to isaaclab -o arm.py',
    'leo export repaired.yaml -o arm.xml --check bags/run1   # what leaving things out costs',
)
ENDINGS = {format_.ending: name for name, format_ in FORMATS.items()}
TIMES = 2.0  # errors larger by more are given as multiples, not in percent
ENDLESS = 'without end'
COLUMNS = {
    'ours': 'this model',
    'reduced': 'what {} holds',
    'exported': 'the file in MuJoCo',
    'noise_floor': 'noise floor',
}


@told_when_ended()
def main(argv: list[str]) -> int:
    options = _parser().parse_args(argv)

    from leo_sim.export.files import export
    from leo_sim.model.model_file import load_model

    format_, output = _chosen(options)
    model = load_model(options.model)
    made = export(model, options.model, format_, output)
    for path in made.texts:
        if path.exists():
            raise UserError(f'{path} exists; choose a new file')
    checked = _checked(options, model, made, format_) if options.check else None
    write_together(made.texts)
    data = {
        'file': str(output),
        'files': [str(path) for path in made.texts],
        'format': format_.name,
        'written_for': format_.version,
        'effects': made.held.effects,
        'left_out': made.held.left_out,
        'check': checked,
        'next': _next(format_, output),
    }
    if options.json:
        print(json.dumps(data, indent=2, allow_nan=False))
    else:
        _print(data, model)
    return 0


def _parser() -> Parser:
    parser = common.parser('export', __doc__ or '', EXAMPLES)
    parser.add('model MODEL', 'a model file, a robot name or a robot folder')
    parser.add('--to', 'the format; where -o is given, its ending says it', choices=FORMATS)
    endings = ', '.join(f'FILE{f.ending} is {f.name}' for f in FORMATS.values())
    about = f'a new file: {endings}; by default the name of MODEL, here'
    parser.add('-o FILE', about, dest='output', type=Path)
    parser.add(
        '--check BAG',
        'print the errors on these recordings: the model as it is, less what the format '
        'does not hold, and (MJCF) MuJoCo with the exported file',
        nargs='+',
    )
    parser.add('--topic-map MAP.yaml', 'other names in the bags')
    add_effect_argument(parser)
    return parser


def _chosen(options: Namespace) -> tuple[Format, Path]:
    """The format and the file; UserError: neither says which, or they differ."""
    output: Path | None = options.output
    endings = ', '.join(f'{ending} ({name})' for ending, name in ENDINGS.items())
    if output is None:
        if options.to is None:
            raise UserError(f'which format? give --to {"|".join(FORMATS)}')
        model = Path(options.model).resolve()
        name = model.stem if model.suffix in ('.yaml', '.yml') else model.name
        return FORMATS[options.to], Path(name + FORMATS[options.to].ending)
    by_name = ENDINGS.get(output.suffix)
    if by_name is None or options.to not in (None, by_name):
        asked = f'--to {options.to} is written to' if options.to else 'the format is said by'
        wanted = FORMATS[options.to].ending if options.to else endings
        raise UserError(f'{output}: {asked} a file that ends in {wanted}')
    return FORMATS[by_name], output


def _checked(options: Namespace, model: Model, made: Export, format_: Format) -> dict[str, Any]:
    from leo_diffmodel.exported.check import check, needs_mujoco, STAGES

    text = next(iter(made.texts.values())) if format_.name == 'MJCF' else None
    if text is not None:
        needs_mujoco()
    recordings = common.read_bags(options.check, model, options.topic_map)
    with progress('checking', STAGES) as reporter:
        return check(recordings, model, made.held.simulated, text, reporter)


def _next(format_: Format, output: Path) -> str:
    if format_.name == 'MJCF':
        return shlex.join(['python', '-m', 'mujoco.viewer', f'--mjcf={output}'])
    if format_.name == 'SDF':
        return shlex.join(['gz', 'sdf', '--check', str(output)])
    if format_.name == 'URDF':
        return leo('robot', 'init', output, '-o', 'FOLDER')
    return f'give ROBOT_CFG of {output} to a scene of Isaac Lab'


def _print(data: dict[str, Any], model: Model) -> None:
    print(f'wrote {" and ".join(data["files"])}: {model.robot.name} as {data["format"]}')
    print(f'for {data["written_for"]}')
    for line in data['effects']:
        print(f'holds {line}')
    for line in data['left_out']:
        print(f'left out: {line}')
    if data['check'] is not None:
        _print_check(data['check'], data['format'])
    print(f'next: {data["next"]}')


def _print_check(check: dict[str, Any], format_name: str) -> None:
    errors = check['errors']
    kind = 'median' if check['statistic'] == 'median' else 'rms'
    title = f'{kind} error {check["seconds"]:.2g} s ahead of the measured start'
    heads = [said.format(format_name) for name, said in COLUMNS.items() if name in errors]
    table = Table('state', *figures(*heads), title=title)
    for i, state in enumerate(check['states']):
        found = [errors[name][i] for name in COLUMNS if name in errors]
        cells = [ENDLESS if error is None else f'{error:.4g}' for error in found]
        table.add_row(f'{state["name"]} [{state["unit"]}]', *cells)
    Terminal(highlight=False).print(table)
    held = _change(check, 'reduced', 'ours')
    print(f'error of what {format_name} holds: {held} beside this model')
    if 'exported' not in errors:
        print(f'(by our engine; nothing that reads {format_name} ran)')
        return
    print(
        f'error of the file in MuJoCo: {_change(check, "exported", "ours")} beside this model, '
        f'{_change(check, "exported", "reduced")} beside what {format_name} holds'
    )


def _change(check: dict[str, Any], name: str, of: str) -> str:
    """How much larger an error is than another, over the states of each unit."""
    by_unit = check['by_unit']
    pairs = ((unit, by_unit[name][unit], value) for unit, value in by_unit[of].items() if value)
    return ', '.join(f'{_more(error, value)} ({unit})' for unit, error, value in pairs)


def _more(error: float | None, value: float) -> str:
    if error is None:
        return ENDLESS
    ratio = error / value
    return f'{100 * (ratio - 1):+.2g} %' if ratio < TIMES else f'{ratio:.3g} times'
