# SPDX-License-Identifier: Apache-2.0
"""leo add: write a new model file with an effect in it, from an explanation or by hand."""

from __future__ import annotations

import argparse
import json

from leo_diffmodel.add.patch import from_explanation, from_words
from leo_diffmodel.verbs import common
from leo_msgs_py.errors import UserError
from leo_sim.model_file import save_model

EXAMPLES = (
    'leo add pendulum --from out/explain/explain.json -o repaired.yaml',
    'leo add pendulum coulomb_friction:pivot c=0.002 -o rough.yaml',
)


def main(argv: list[str]) -> int:
    """Run `leo add`; exit status 0."""
    arguments = _parser().parse_intermixed_args(argv)
    model = common.load(arguments)
    if bool(arguments.source) == bool(arguments.words):
        raise UserError('give either --from explain.json, or EFFECT[:WHERE] PARAM=VALUE …')
    if arguments.source:
        model, entries = from_explanation(model, arguments.source)
    else:
        model, entries = from_words(model, arguments.words)
    save_model(arguments.output, model, [*model.history, *entries])
    if arguments.json:
        print(json.dumps({'model': arguments.output, 'history': entries}))
        return 0
    print(f'wrote {arguments.output}: {", ".join(str(e["added"]) for e in entries)}')
    print(f'next: leo compare BAG --model {arguments.output}')
    return 0


def _parser() -> argparse.ArgumentParser:
    arguments = common.parser('add', __doc__ or '', EXAMPLES)
    arguments.add_argument('model', help='a model file, a robot name or a robot folder')
    arguments.add_argument('words', nargs='*', default=[], metavar='EFFECT[:WHERE] PARAM=VALUE')
    arguments.add_argument('--from', dest='source', metavar='explain.json')
    arguments.add_argument('-o', dest='output', required=True, metavar='NEW.yaml')
    arguments.add_argument('--json', action='store_true', help='print the result as JSON')
    return arguments
