# SPDX-License-Identifier: Apache-2.0
"""The answer says from how many recordings, and for which angles, speeds and loads, it is."""

from dataclasses import replace
from types import SimpleNamespace

from tests.simulate import PENDULUM, TORQUE

from leo_diffmodel.explain.decide import Decision, Named
from leo_diffmodel.explain.findings.findings import Range, Shown
from leo_diffmodel.explain.rows import shown_for
from leo_diffmodel.explain.sentence import next_run, shown, told
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.description.robot_file import SensorFile

PIVOT = Shown('pivot', Range(-1.23, 2.0, 'rad'), Range(-6, 5.5, 'rad/s'), Range(0, 0.31, 'N m'))


def findings(*joints, bags=('a',)):
    return SimpleNamespace(shown=joints, bags=bags, numerics=SETTINGS.numerics)


def open_as(verdict, *named):
    return Decision(verdict, named, (), (), ())


def test_one_recording_is_said_to_be_one():
    where = 'angles -1.2 to 2 rad, speeds -6 to 5.5 rad/s, torques in the gear 0 to 0.31 N m'
    assert shown(findings(PIVOT)) == f'Shown in one recording, with pivot at {where}.'
    told = shown(findings(PIVOT, bags=('a', 'b')))
    assert told.startswith('Shown in 2 recordings, with pivot at')


def test_of_many_joints_the_first_are_said_and_all_listed():
    many = findings(*(PIVOT._replace(joint=f'j{i}') for i in range(7)))
    said = shown(many)
    assert 'j2 at' in said and 'j3' not in said and said.endswith(', and 4 more joints.')
    assert [*shown_for(many)] == [f'j{i}' for i in range(7)]
    assert shown_for(many)['j6']['angle'] == {'low': -1.23, 'high': 2.0, 'unit': 'rad'}


def test_where_nothing_is_named_nothing_is_shown():
    assert shown(findings()) == '' and shown_for(findings()) == {}


def test_an_answer_that_was_cut_short_says_so_and_asks_for_more_time():
    named, notes = [Named('armature:pivot', 'J = 1 kg m2')], ['the time was over; not tried: x']
    said = told('ambiguous', named, 'held-out error 1 -> 0', notes, cut_short=True)
    assert str(said) == (
        'Cut short, so nothing is sure: armature:pivot (J = 1 kg m2); '
        'held-out error 1 -> 0 (the time was over; not tried: x).'
    )
    none = told('ambiguous', [], 'held-out error 1 -> 1', cut_short=True)
    assert str(none) == 'Cut short, so nothing is sure: held-out error 1 -> 1.'
    cut = SimpleNamespace(search=SimpleNamespace(complete=False))
    assert (
        next_run(open_as('ambiguous'), cut) == 'the same again without --within, or with more time'
    )


def test_what_is_not_sure_beside_what_is_asks_for_a_run():
    base, search = SimpleNamespace(robot=TORQUE), SimpleNamespace(complete=True)
    gates = SETTINGS.gates
    made = SimpleNamespace(search=search, base=base, unknown=None, effects=(), gates=gates)
    sure, weak = Named('a:pivot', ''), Named('b:pivot', '', doubt='x')
    assert 'leo next with the same bags' in next_run(open_as('partly', sure, weak), made)
    assert 'leo next' not in next_run(open_as('partly', sure), made)


def test_what_no_effect_explains_may_be_the_noise_of_a_torque():
    said = replace(TORQUE, sensors={'pivot': SensorFile(input_noise=0.1)})
    asked = []
    for robot in (TORQUE, said, PENDULUM):
        search, base = SimpleNamespace(complete=True), SimpleNamespace(robot=robot)
        made = SimpleNamespace(search=search, base=base, unknown=None)
        asked.append(next_run(open_as('unknown'), made))
    first, *others = asked
    told = 'repeat the run, then vary one thing at a time: speed, load, angle, supply'
    assert others == [told] * 2
    assert first.startswith(others[0]) and 'input_noise in robot.yaml' in first
