# SPDX-License-Identifier: Apache-2.0
"""What to warn of where effects are added: values far out, a difference model that is lost."""

from collections.abc import Iterator, Sequence

from leo_diffmodel.explain.problem.candidates import limited
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.settings import SETTINGS
from leo_msgs_py.errors import UserError
from leo_sim.effects import Placed
from leo_sim.effects.base import Parameter, with_roles
from leo_sim.model import Model


def doubts(given: Model, changed: Model, named: str) -> Iterator[str]:
    """What speaks against a model with more effects, which lines call `named`, a line each."""
    if given.difference_model is not None:
        yield (
            f'{named} is without the difference model {given.difference_model}, which was '
            'fitted without these effects; fit it anew'
        )
    yield from implausible(given, changed.effects[len(given.effects) :])


def implausible(model: Model, added: Sequence[Placed]) -> Iterator[str]:
    """A line for each value outside of what is plausible for the model's robot."""
    for use in added:
        for p in _limited(model, use):
            value, most = use.parameters[p.name], f'{p.low:.3g} to {p.high:.3g} {p.unit}'.rstrip()
            if value != p.neutral and not p.low <= value <= p.high:
                yield (
                    f'{use.effect.name}.{p.name}: {value:g} is outside {most}, what a search '
                    f'takes for plausible on {model.robot.name}; is its unit right?'
                )


def _limited(model: Model, use: Placed) -> tuple[Parameter, ...]:
    """The parameters with the bounds of a search; none where nobody knows what is large."""
    where = use.where[0] if len(use.where) == 1 else 'all'
    parameters = with_roles(use.effect, use.effect.parameters_for(model.robot, use.where))
    try:
        return limited(Candidate(use.effect, where, parameters), model, SETTINGS.grids).parameters
    except UserError:
        return ()
