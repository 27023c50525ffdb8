# SPDX-License-Identifier: Apache-2.0
"""What readers and authors are told of effects is what the catalogue has."""

import pytest
from tests.places import ROOT

from leo_sim.effects import EFFECTS
from leo_sim.effects.base import Body, Drive, Ground, HOOKS


@pytest.mark.parametrize('name', EFFECTS)
def test_every_effect_has_its_equation_in_its_parameters(name):
    effect = EFFECTS[name]
    assert all(p.name in effect.equation for p in effect.parameters)


def test_authors_are_told_every_hook_and_every_figure_that_it_changes():
    text = (ROOT / 'docs/your_effect.md').read_text()
    figures = {'drive': Drive, 'link': Body, 'ground': Ground}
    told = [f'| `{hook}` | `{hook}(p, ' for hook in HOOKS]
    told += [f'`{name}.{f}`' for name, kind in figures.items() for f in kind._fields]
    assert [words for words in told if words not in text] == []
