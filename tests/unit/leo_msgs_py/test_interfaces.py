# SPDX-License-Identifier: Apache-2.0
"""Types by the names that a graph gives them: nothing else is imported for it."""

import pytest

from leo_msgs_py.errors import UserError
from leo_msgs_py.interfaces import fill, load, to_plain


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


@pytest.mark.parametrize(
    ('name', 'data'),
    [
        ('std_msgs/msg/Bool', {'data': 1}),
        ('std_msgs/msg/UInt8', {'data': 300}),
        ('std_msgs/msg/UInt8', {'data': 1.5}),
        ('std_msgs/msg/String', {'data': 3}),
        ('std_msgs/msg/Byte', {'data': 256}),
        ('std_msgs/msg/Header', {'stamp': {'sec': 2**31}}),
        ('sensor_msgs/msg/JointState', {'name': 5}),
    ],
)
def test_what_a_field_does_not_hold_is_refused_and_not_sent_as_something_else(name, data):
    """rclpy alone sends False for 1 and 44 for 300."""
    pytest.importorskip('sensor_msgs')
    with pytest.raises(UserError, match='cannot be'):
        fill(load(name)(), data)


@pytest.mark.parametrize(
    ('name', 'data'),
    [
        ('std_msgs/msg/Float64MultiArray', {'data': [1, 2.5]}),
        ('std_msgs/msg/Byte', {'data': 7}),
        ('std_msgs/msg/ByteMultiArray', {'data': [1, 255]}),
    ],
)
def test_what_was_set_is_shown(name, data):
    pytest.importorskip('std_msgs')
    assert to_plain(fill(load(name)(), data))['data'] == data['data']
