# SPDX-License-Identifier: Apache-2.0
"""`leo datasheet`: the figures of a motor on the bench, from a standard motion or from bags."""

from __future__ import annotations

from contextlib import redirect_stdout
import json
from pathlib import Path
import sys
import time
from typing import Any, TYPE_CHECKING

from leo_diffmodel.verbs import common
from leo_diffmodel.verbs.next import predict_words
from leo_msgs_py.console import progress, Table, Terminal
from leo_msgs_py.ending import told_when_ended
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.verbs.common import Parser, ros_args_apart
from leo_msgs_py.whole_file import json_text, write_together
from leo_sim.common.consent import add_effect_argument

if TYPE_CHECKING:
    from leo_sim.model import Model

EXAMPLES = """\
  leo datasheet --model xl330_pendulum -o unit1       (drives the running robot for 73 s)
  leo datasheet bags/unit1 --model xl330_pendulum -o unit1
  leo datasheet bags/light bags/heavy --model bench.yaml -o unit1   (two loads)
  leo datasheet --model so101 --joint elbow_flex --motion elbow.csv (then leo play elbow.csv)
  leo datasheet unit1/datasheet.json unit2/datasheet.json           (side by side)"""


def main(argv: list[str]) -> int:
    """Exit status 1 where not every figure is known."""
    words, ros_args = ros_args_apart(argv)
    options = _parser().parse_args(words)
    if options.inputs and all(Path(name).suffix == '.json' for name in options.inputs):
        return _beside(options)
    if options.model is None:
        raise UserError('leo datasheet: --model names the robot, a folder or a model file')

    from leo_sim.model.model_file import load_model

    model = load_model(options.model)
    joint = _joint(options.joint, model)
    if options.motion:
        return _motion(options, model, joint)
    folder = common.fresh_folder(options.output)
    if not options.inputs:
        options.inputs = [str(_played(options, model, joint, folder, ros_args))]
    data = _sheet(options, model, joint, folder)
    if options.json:
        print(json.dumps(data))
    else:
        _show(data, folder)
    return 1 if data['not_known'] else 0


def _parser() -> Parser:
    parser = Parser('leo datasheet', 'The figures of a motor, with intervals.', EXAMPLES)
    parser.add(
        'inputs BAG',
        'recordings of the motor with a known load; none: the running robot is driven; '
        'or datasheet.json files, side by side',
        nargs='*',
    )
    parser.add('--model --robot M', 'a model file, a robot name or folder')
    parser.add('--joint J', 'which motor, where there are several')
    parser.add('--topic-map MAP.yaml', 'other topic and joint names')
    parser.add('--motion CSV', 'write the motion, no more', type=Path)
    parser.flag('--yes', 'drive without asking (as leo play)')
    parser.add('-o DIR', 'write JSON and page here', dest='output')
    add_effect_argument(parser)
    return parser


def _joint(named: str | None, model: Model) -> str:
    names = [a.joint for a in model.robot.actuators]
    if named is None and len(names) != 1:
        listed = ', '.join(names) or 'none'
        raise UserError(f'name a motor of {model.robot.name} with --joint: {listed}')
    return named or names[0]


def _motion(options: Any, model: Model, joint: str) -> int:
    from leo_diffmodel.datasheet.measure import opened
    from leo_diffmodel.datasheet.motion import motion
    from leo_diffmodel.next_run.run_file import write_run

    run = motion(opened(model, joint), joint)
    write_run(options.motion, run, model.robot)
    seconds = run.count * model.robot.control_period
    print(f'wrote {options.motion}: {seconds:.0f} s of {joint}, {run.about}')
    predicted = predict_words(options.model, model)
    print(f'next: {leo("play", options.motion, *predicted, "--bag", "bags/unit1")}')
    return 0


def _played(
    options: Any, model: Model, joint: str, folder: Path | None, ros_args: list[str]
) -> Path:
    from leo_diffmodel.datasheet.measure import opened
    from leo_diffmodel.datasheet.motion import motion
    from leo_diffmodel.next_run.run_file import write_run
    from leo_learner.verbs.play import main as play

    if folder is None:
        raise UserError('leo datasheet: -o DIR takes the recording of the running robot')
    bag = folder / 'bag'
    if bag.exists():
        raise UserError(f'{bag} exists: give it as BAG to read it, or choose another -o')
    run = motion(opened(model, joint), joint)
    folder.mkdir(parents=True, exist_ok=True)
    file = write_run(folder / 'motion.csv', run, model.robot)
    asked = ['--yes'] * options.yes
    words = [str(file), '--bag', str(bag), '--predict', options.model, *asked, *ros_args]
    with redirect_stdout(sys.stderr if options.json else sys.stdout):
        left_off = play(words)
    if left_off:
        raise UserError(f'{file} was not played to its end; nothing is measured')
    return bag


@told_when_ended()
def _sheet(options: Any, model: Model, joint: str, folder: Path | None) -> dict[str, Any]:
    from leo_diffmodel.bags.episode import distinct
    from leo_diffmodel.compare.known import provenance
    from leo_diffmodel.datasheet.measure import measure
    from leo_diffmodel.datasheet.sheet import conditions, sheet

    recordings = common.read_bags(options.inputs, model, options.topic_map)
    began = time.monotonic()
    distinct(recordings)
    with progress('measuring') as reporter:
        found = measure(recordings, model, joint, common.own_effects(options), reporter)
        data = sheet(found) | {'conditions': conditions(options.inputs, joint)}
        data['provenance'] = provenance(recordings, model)
        data['seconds'] = time.monotonic() - began
    if folder:
        from leo_diffmodel.datasheet.page import sheet_page

        page, answer = sheet_page(data, found, recordings), json_text(data)
        write_together({folder / 'datasheet.json': answer, folder / 'datasheet.html': page})
    return data


def _show(data: dict[str, Any], folder: Path | None) -> None:
    from leo_diffmodel.datasheet.words import errors_in_words, figures, friction, values_of

    console, error = Terminal(), data['error']
    title = f'{data["robot"]}, motor at {data["joint"]}'
    console.print(Table('figure', 'value ± 95 %', '', rows=figures(data), title=title))
    laws = Table('friction law', 'values', 'held-out error', 'behind [nats]', '')
    for row in data['ladder']:
        values, errors = '\n'.join(values_of(row['effects'])), errors_in_words(row['error'])
        laws.add_row(row['law'], values, errors, f'{row["behind_nats"]:.1f}', row['verdict'])
    laws.caption = f'{error["figure"]}; noise alone {errors_in_words(error["noise"])}'
    console.print(laws)
    console.print(f'friction: {friction(data)}', highlight=False)
    for note in data['notes']:
        console.print(note, highlight=False)
    if folder:
        print(f'wrote {folder}/datasheet.json and datasheet.html')


def _beside(options: Any) -> int:
    from leo_diffmodel.datasheet.words import beside

    sheets = [_read(Path(name)) for name in options.inputs]
    if options.json:
        print(json.dumps(sheets))
        return 0
    names = [Path(name).parent.name or name for name in options.inputs]
    Terminal().print(Table('figure', *names, rows=beside(sheets), title='side by side'))
    return 0


def _read(path: Path) -> dict[str, Any]:
    from leo_diffmodel.datasheet.words import beside

    try:
        data = json.loads(path.read_text(encoding='utf-8'))
    except (OSError, ValueError, RecursionError) as error:
        raise UserError(f'cannot read {path}: {error}') from error
    try:
        list(beside([data]))
    except (LookupError, TypeError, AttributeError, ValueError, RuntimeError) as error:
        raise UserError(
            f'{path} is no data sheet; leo datasheet BAG… -o DIR writes one'
        ) from error
    return data
