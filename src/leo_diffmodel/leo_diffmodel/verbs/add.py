# SPDX-License-Identifier: Apache-2.0
"""leo add: write a new model file with an effect in it, from an explanation or by hand."""

import argparse
import sys

from leo_diffmodel.verbs import common
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.verbs.common import Parser, show
from leo_sim.common.consent import add_effect_argument, effect_words

EXAMPLES = (
    'leo add pendulum --from out/explain/explain.json -o repaired.yaml',
    'leo add pendulum coulomb_friction:pivot c=0.002 -o rough.yaml',
    'leo add pendulum coulomb_friction c=0.002 command_delay delay=0.01 -o rough.yaml',
    'leo add --from out/explain/explain.json --robot my_pendulum -o sibling.yaml',
)


def main(argv: list[str]) -> int:
    arguments = _parser().parse_intermixed_args(argv)

    from leo_diffmodel.add.patch import from_explanation, from_words
    from leo_diffmodel.add.plausible import doubts
    from leo_sim.model.model_file import load_model, save_model

    given = model = load_model(_model(arguments))
    if bool(arguments.source) == bool(arguments.words):
        raise UserError('give either --from explain.json, or EFFECT[:WHERE] PARAM=VALUE …')
    if arguments.source:
        model, entries = from_explanation(model, arguments.source, arguments.robot is not None)
    else:
        model, entries = from_words(model, arguments.words)
    save_model(arguments.output, model, [*model.history, *entries])
    for line in doubts(given, model, arguments.output):
        print(f'warning: {line}', file=sys.stderr)
    wrote = f'wrote {arguments.output}: {", ".join(str(e["added"]) for e in entries)}'
    following = ['--model', arguments.output, *effect_words(model.effects)]
    lines = [wrote, f'next: {leo("compare", "BAG", *following)}']
    show(arguments, {'model': arguments.output, 'history': entries}, lines)
    return 0


def _model(arguments: argparse.Namespace) -> str:
    if arguments.robot is not None and not arguments.source:
        raise UserError('--robot goes with --from explain.json: it moves one to another robot')
    if (arguments.model is None) == (arguments.robot is None):
        raise UserError('give MODEL, or with --from explain.json --robot OTHER, and not both')
    return str(arguments.model or arguments.robot)


def _parser() -> Parser:
    arguments = common.parser('add', __doc__ or '', EXAMPLES)
    arguments.add('model', 'a model file, a robot name or a robot folder', nargs='?')
    about, shown = 'effects, each with its parameters after it', 'EFFECT[:WHERE] PARAM=VALUE'
    arguments.add('words', about, nargs='*', default=[], metavar=shown)
    arguments.add_argument('--from', dest='source', metavar='explain.json')
    arguments.add('--robot OTHER', 'move it to this robot or model with the same places')
    add_effect_argument(arguments, 'a Python file that MODEL or explain.json names, and may run')
    arguments.add_argument('-o', dest='output', required=True, metavar='NEW.yaml')
    return arguments
