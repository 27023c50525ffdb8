# SPDX-License-Identifier: Apache-2.0
"""Every number of explain: few gates, each told what it is, and all of them in force."""

import ast
from dataclasses import fields
import inspect
import json

import pytest
from tests.searched import searched
from tests.simulate import record, TORQUE

from leo_diffmodel.explain import settings as ours
from leo_diffmodel.explain.explanation import explain
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

MOST, FRICTION = 40, 'coulomb_friction'
PARTS = [type(getattr(ours.SETTINGS, part.name)) for part in fields(ours.Settings)]


def test_there_are_few_gates():
    assert 10 < len(fields(ours.Gates)) <= MOST


@pytest.mark.parametrize('part', PARTS)
def test_each_number_says_what_it_is(part):
    lines = [*inspect.getsource(part).splitlines(), '']
    (table,) = ast.parse('\n'.join(lines)).body
    numbers = [node for node in table.body if isinstance(node, ast.AnnAssign)]
    assert len(numbers) == len(fields(part))
    for number in numbers:
        above, below = lines[number.lineno - 2], lines[number.end_lineno]
        said = '  # ' in lines[number.end_lineno - 1] or above.lstrip().startswith('# ')
        assert said or below.lstrip().startswith('"""'), ast.unparse(number)


def test_a_page_can_show_what_each_gate_is():
    told = ours.texts(ours.Gates)
    assert list(told) == [f.name for f in fields(ours.Gates)]
    assert all(told.values())


def test_a_number_has_one_name():
    names = [f.name for part in PARTS for f in fields(part)]
    assert len(set(names)) == len(names)


def test_the_gates_are_told_by_name_and_value():
    told = ours.SETTINGS.gates.to_json()
    assert list(told) == [f.name for f in fields(ours.Gates)]
    assert told.pop('window_nats') is None and json.dumps(told, allow_nan=False)
    assert all(v == getattr(ours.SETTINGS.gates, name) and v > 0 for name, v in told.items())


def test_the_ground_has_numbers_of_its_own_and_a_users_are_taken_as_they_are():
    own = ours.settings_for(load_robot('leo'))
    assert ours.settings_for(TORQUE) == ours.SETTINGS
    assert own == ours.SETTINGS.changed(**ours.ON_GROUND)
    assert own.gates.to_json()['window_nats'] == 6.0
    for part in PARTS:
        given = ours.ON_GROUND.keys() & {f.name for f in fields(part)}
        assert given and not any(ours.ON_GROUND[name] == getattr(part(), name) for name in given)


def test_numbers_are_changed_by_name():
    other = ours.SETTINGS.changed(turns=7, huber=3.0, gap=0.1)
    assert (other.gates.turns, other.numerics.huber, other.grids.gap) == (7, 3.0, 0.1)
    assert other.changed(turns=ours.SETTINGS.gates.turns, huber=2.5, gap=0.5) == ours.SETTINGS
    with pytest.raises(TypeError, match=r"no setting is named \['hubert'\]"):
        ours.SETTINGS.changed(hubert=3.0)


def windows(run, **changed):
    """In how many windows explain looks, as it says where gates ask for more."""
    settings = ours.SETTINGS.changed(fewest_windows=1000, **changed)
    found = explain([run], Model(TORQUE), settings=settings)
    assert found.verdict == 'untestable'
    return int(found.sentence.partition('data in ')[2].split()[0])


def test_a_number_of_each_of_the_three_reaches_the_problem():
    run = record(TORQUE, seconds=6)
    assert windows(run, search_seconds=0.15) > windows(run) > 5
    assert windows(run, most_windows=5) == 5


def test_a_number_of_each_of_the_three_reaches_a_search():
    data = [record(TORQUE, place(TORQUE, FRICTION, 'pivot', c=0.3), seconds=6)]
    other = ours.SETTINGS.changed(price=1.0, huber=1.5, delays=(0.1,))
    before, after = (searched(data, Model(TORQUE), s) for s in (ours.SETTINGS, other))
    assert after.weight.price > 1.9 * before.weight.price
    assert after.null.loss.sum() < before.null.loss.sum()  # where it is linear it rises less
    late = [
        next(s.evidence for s in found.scans if s.candidate.effect.name == 'command_delay')
        for found in (before, after)
    ]
    assert late[1] > 1.2 * late[0]
