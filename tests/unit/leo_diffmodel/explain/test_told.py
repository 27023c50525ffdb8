# SPDX-License-Identifier: Apache-2.0
"""An answer is told in one sentence, or in a headline and lines where that is too long."""

from leo_diffmodel.explain.told import Thing, Told

SPACE = 190
ERROR = 'median held-out error 0.3 s ahead: a 2 -> 1 rad (noise 1) and 9 more states'
NOTES = ('left out, --keep uses it: 1.0 to 2.0 s (a: pushed; hard (here))', 'the time was over')
REST = '40 % of the mean squared error beyond noise is something else, most of it at a.'
EFFECTS = (
    Thing('stribeck_friction:elbow', '(c = 0.124 ± 0.01 N m; a note; v_s = 0.1 rad/s)'),
    Thing('encoder_offset:elbow', '(o = 0.038 rad), or bias_torque:elbow or link_com:fore'),
    Thing('viscous_friction:shoulder', '(b = 0.0587 N m s/rad), the same as back_emf_scale'),
)


def masses(names: str) -> tuple[Thing, ...]:
    return tuple(Thing(f'link_mass:{name}', '(m = 1 ± 0.1 kg)') for name in names)


def test_all_of_it_is_one_sentence_and_what_follows():
    said = Told('Missing for sure', masses('ab'), 'held-out error less', NOTES[1:], (REST,))
    assert str(said) == (
        'Missing for sure: link_mass:a (m = 1 ± 0.1 kg); link_mass:b (m = 1 ± 0.1 kg); '
        f'held-out error less (the time was over). {REST}'
    )


def test_what_fits_is_one_line():
    said = Told('Nothing', change='held-out error 0.5 s ahead: a 1 -> 1 rad', notes=('b',))
    assert said.lines(SPACE) == ['Nothing: held-out error 0.5 s ahead: a 1 -> 1 rad (b).']


def test_notes_have_lines_of_their_own_where_they_do_not_fit():
    said = Told('Missing', masses('a'), 'held-out error less', 3 * NOTES)
    head = str(Told('Missing', masses('a'), 'held-out error less'))
    assert said.lines(SPACE) == [head, *said.notes]


def test_what_does_not_fit_is_a_headline_and_lines():
    effects = masses('abcdefgh')
    said = Told('Missing for sure', effects, ERROR, NOTES, (REST,))
    assert said.lines(SPACE) == [
        f'Missing for sure: {"; ".join(e.name for e in effects)}.',
        *(f'{effect}.' for effect in effects),
        f'{ERROR}.',
        REST,
        *NOTES,
    ]


def test_a_headline_that_fits_says_all_of_its_effects():
    said = Told('Missing', masses('abc'), ERROR + ERROR, NOTES)
    head, *lines = said.lines(SPACE)
    assert head == str(Told('Missing', masses('abc'))) and lines == [f'{said.change}.', *NOTES]


def test_a_headline_that_is_too_long_names_the_effects_and_gives_each_a_line():
    said = Told('Something is missing that this data cannot pin down', EFFECTS, 'less')
    names = '; '.join(effect.name for effect in EFFECTS)
    assert said.lines(SPACE)[0] == f'{said.about}: {names}.'
    assert said.lines(SPACE)[1:4] == [f'{effect}.' for effect in EFFECTS]


def test_what_has_no_words_is_said_once():
    faults = [Thing(f'the speed of joint_{n} has another sign than the angle') for n in range(6)]
    said = Told('The log is wrong', tuple(faults))
    assert said.lines(SPACE) == [str(said)]
