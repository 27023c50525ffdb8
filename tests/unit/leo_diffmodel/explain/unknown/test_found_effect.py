# SPDX-License-Identifier: Apache-2.0
"""A found law as an effect, and the file of it: the same numbers, and no name runs."""

from types import SimpleNamespace

import numpy as np
import pytest

from leo_diffmodel.explain.settings import SETTINGS
from leo_diffmodel.explain.unknown.curves import Variable
from leo_diffmodel.explain.unknown.families import families, table
from leo_diffmodel.explain.unknown.found_effect import FoundEffect, text_of
from leo_diffmodel.explain.unknown.law import Law
from leo_sim.effects import Effect, get_effect

JOINT = 'elbow\'\'\'"""\n__import__("pathlib").Path("ran").touch()\n"""'
SAME = 'name hook parameters equation looks_like dry motor_side uses_load remembers timed steady'
VALUES = np.linspace(-3.0, 4.0, 60)
KINDS = [
    ('angle', 'torque', None),
    ('angle', 'friction', 2 * np.pi),
    ('rate', 'drive', None),
    ('input', 'torque', None),
    ('input', 'friction', None),
    ('load', 'friction', None),
    ('time', 'torque', None),
    ('path', 'torque', None),
]


def laws(name: str, carrier: str, period: float | None, hertz: float = 0.0) -> list[Law]:
    """Every form of law of a variable, and its table, with some values."""
    knots = np.linspace(-3.0, 3.0, 8)
    variable = Variable(name, JOINT, 'rad', VALUES, knots, period)
    curve = SimpleNamespace(variable=variable, carrier=carrier, hertz=hertz)
    forms = families(curve, SETTINGS.grids)
    if name != 'path':
        forms.append(table(variable, np.sin(knots) / 3))
    made = []
    for form in forms:
        count = len(form.linear) + len(form.shapes)
        values = 0.3 + 0.17 * np.arange(count)
        made.append(Law.of(curve, form, values))
    return made


def answers(effect: Effect, law: Law) -> list[np.ndarray]:
    """What an effect gives for some motion, its memory included."""
    p = dict(zip((parameter.name for parameter in law.parameters), law.values, strict=True))
    q, dq = VALUES[:, None], np.cos(VALUES)[:, None]
    if effect.hook == 'command':
        return [effect.command(p, q, None, 0.01)[0]]
    motor = SimpleNamespace(torque=0.2 * q)
    if not effect.remembers:
        return [effect.torque(p, q, dq, motor, 0.7 * dq)]
    memory = effect.remember(p, q, dq, 0.5, 0.01)
    return [memory, effect.torque(p, q, dq, motor, 0.7 * dq, memory)]


@pytest.mark.parametrize(('name', 'carrier', 'period'), KINDS)
def test_the_file_gives_what_the_effect_gives(name, carrier, period, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    waves = laws(name, carrier, period, 1.3)[:1] if name == 'time' else []
    for number, law in enumerate([*laws(name, carrier, period), *waves]):
        found = FoundEffect(law, JOINT, 2.5)
        file = tmp_path / f'found_{number}.py'
        file.write_text(text_of(found))
        read = get_effect(str(file))
        for attribute in SAME.split():
            assert getattr(read, attribute) == getattr(found, attribute)
        for one, other in zip(answers(found, law), answers(read, law), strict=True):
            np.testing.assert_array_equal(one, other)
    assert not (tmp_path / 'ran').exists()


def test_a_law_is_read_at_values_as_its_effect_is():
    law = next(law for law in laws('angle', 'torque', None) if 'np.sin' in law.family.text)
    a, n, phase = law.values
    assert law.at(VALUES) == pytest.approx(a * np.sin(n * VALUES + phase))
