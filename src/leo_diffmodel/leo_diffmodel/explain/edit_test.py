# SPDX-License-Identifier: Apache-2.0
"""The edit test: what was named is taken out of the repaired model, and of the robot.

Where a payload was found, the robot without its payload must move as the repaired model without
that effect does, its refitted constants kept. Bags of the robot so changed say whether it does.
"""

from collections.abc import Callable, Iterable, Sequence

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.ranking import rank
from leo_msgs_py.errors import UserError
from leo_sim.model import Model

GIVEN, REPAIRED, ALL = 'as given', 'repaired', 'without all of them'


def edit_test(
    given: Model,
    repaired: Model,
    bags: Sequence[Recording],
    step: float | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> dict:
    """Predict bags of the changed robot with the model as given, repaired, and edited.

    `given` was explained; `repaired` has what was named, and constants as refitted; no fit has
    seen the bags. UserError where nothing was named, and as `compare.ranking.rank`.
    """
    edited = _edited(given, repaired)
    if not edited:
        raise UserError('the edit test takes a named effect out of the model, and none was named')
    data = rank(bags, {GIVEN: given, REPAIRED: repaired, **edited}, step, progress)
    return {
        'bags': [str(bag.path) for bag in bags],
        'edited': list(edited),
        'sentence': _sentence(data, edited),
        **{key: data[key] for key in ('states', 'seconds', 'windows', 'blocks', 'models')},
    }


def _edited(given: Model, repaired: Model) -> dict[str, Model]:
    """The repaired model without each effect that was named, and without all of them."""
    named = repaired.effects[len(given.effects) :]
    left = {
        f'without {p.effect.name}:{"all" if p.everywhere else ",".join(p.where)}': [
            other for other in named if other is not p
        ]
        for p in named
    } | ({ALL: []} if len(named) > 1 else {})
    return {name: repaired.changed(effects=[*given.effects, *rest]) for name, rest in left.items()}


def _sentence(data: dict, edited: Iterable[str]) -> str:
    """Which model these bags are of, and how near it comes to the noise."""
    best, *others = data['models']
    alike = [row['model'] for row in others if not row['behind']['distinguishable']]
    times = (best['share'] / best['noise_share']) ** 0.5 if best['noise_share'] else float('inf')
    near, equal = f'{times:.2g} times the noise floor', [best['model'], *alike]
    if REPAIRED in equal:
        said = 'what was named is still there'
        if {*edited} & {*equal}:
            said = 'they do not tell the repaired model from the edited one'
        return f'These bags: {said} ({best["model"]}: {near}).'
    also = f', alike: {", ".join(alike)}' if alike else ''
    return f'These bags are best predicted {best["model"]} ({near}{also}).'
