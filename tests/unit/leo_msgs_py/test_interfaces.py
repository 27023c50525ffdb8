# SPDX-License-Identifier: Apache-2.0
"""Types by the names that a graph gives them: nothing else is imported for it."""

import pytest

from leo_msgs_py.errors import UserError
from leo_msgs_py.interfaces import load


@pytest.fixture
def packages(tmp_path, monkeypatch):
    """Two packages: one with a message, and one that does something when it is imported."""
    for name, text in (('polite', ''), ('opener', f'open({str(tmp_path / "ran")!r}, "w")')):
        (tmp_path / name).mkdir()
        (tmp_path / name / '__init__.py').write_text(text)
    (tmp_path / 'polite' / 'msg').mkdir()
    (tmp_path / 'polite' / 'msg' / '__init__.py').write_text('class Word:\n    pass\n')
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_a_message_is_found_by_both_its_names(packages):
    assert load('polite/msg/Word') is load('polite/Word')


@pytest.mark.parametrize(
    'name',
    [
        'opener/msg/Word',
        'opener/Word',
        'opener.msg/Word',
        './Word',
        '../msg/Word',
        'os/path/Join',
        'polite/msg/word',
        'polite/msg/Other',
        '',
    ],
)
def test_no_other_module_is_imported(name, packages):
    with pytest.raises(UserError, match='is installed'):
        load(name)
    assert not (packages / 'ran').exists()
