# SPDX-License-Identifier: Apache-2.0
"""Sealed files: what goes in comes out, and only out of `leo reveal`."""

import json

from hypothesis import given
from hypothesis import strategies as st
import pytest
import yaml

from leo_msgs_py.errors import UserError
from leo_sim.truth.sealing import seal, unseal
from leo_sim.verbs import reveal

PARAMETERS = {'c': {'value': 0.00123, 'unit': 'N m'}}
EFFECT = {'name': 'coulomb_friction', 'where': ['pivot'], 'parameters': PARAMETERS}
TRUTH = {'robot': 'pendulum', 'effects': [EFFECT]}


@given(text=st.text())
def test_what_is_sealed_comes_out_again(tmp_path_factory, text):
    path = tmp_path_factory.mktemp('sealed') / 'a.sealed'
    seal(path, text)
    assert unseal(path) == text


def test_a_sealed_file_does_not_show_what_it_holds(tmp_path):
    seal(tmp_path / 'a.sealed', yaml.safe_dump(TRUTH))
    raw = (tmp_path / 'a.sealed').read_text()
    assert 'leo reveal' in raw
    assert 'coulomb' not in raw and '0.00123' not in raw


def test_reveal_prints_sentences_and_json(tmp_path, capsys):
    seal(tmp_path / 'a.sealed', yaml.safe_dump(TRUTH))
    assert reveal.main([str(tmp_path / 'a.sealed')]) == 0
    assert 'coulomb_friction at pivot: c = 0.00123 N m' in capsys.readouterr().out
    assert reveal.main([str(tmp_path / 'a.sealed'), '--json']) == 0
    assert json.loads(capsys.readouterr().out) == TRUTH


@pytest.mark.parametrize(
    ('change', 'said'),
    [
        (lambda raw: b'effects: []\n', 'is not a sealed file'),
        (lambda raw: b'', 'is not a sealed file'),
        (lambda raw: b'\xff\xfe\x00\x01', 'is not a sealed file'),
        (lambda raw: raw[:-20], 'was changed after it was sealed'),
        (lambda raw: raw.splitlines()[0], 'was changed after it was sealed'),
        (lambda raw: raw.replace(raw.splitlines()[1], 64 * b'0'), 'was changed'),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(tmp_path, change, said):
    path = tmp_path / 'a.sealed'
    seal(path, yaml.safe_dump(TRUTH))
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(UserError, match=said) as caught:
        unseal(path)
    assert len(str(caught.value).splitlines()) == 1
