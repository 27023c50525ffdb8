# SPDX-License-Identifier: Apache-2.0
"""Files are written whole or not at all."""

from pathlib import Path

import pytest
from tests.damage import room_for

from leo_msgs_py.whole_file import whole, write_together, write_whole


@pytest.mark.parametrize(('content', 'read'), [('text é', 'text é'), (b'bytes', 'bytes')])
def test_it_replaces_what_was_there_and_makes_folders(tmp_path, content, read):
    path = tmp_path / 'new' / 'file'
    for _ in range(2):
        assert write_whole(path, content) == path
    assert path.read_text(encoding='utf-8') == read
    assert list(path.parent.iterdir()) == [path]


def test_what_cannot_be_written_leaves_the_one_before(tmp_path):
    path = write_whole(tmp_path / 'file', 'before')
    with room_for(10), pytest.raises(OSError, match='File too large') as error:
        write_whole(path, 'much too long')
    assert error.value.filename == str(path)
    assert path.read_text() == 'before' and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize('second', ['file', 'folder', 'file/under'])
def test_of_files_that_belong_together_all_are_written_or_none(tmp_path, second):
    first = write_whole(tmp_path / 'first', 'before')
    (tmp_path / 'file').write_text('before')
    (tmp_path / 'folder').mkdir()
    there = {*tmp_path.iterdir()}
    with room_for(10), pytest.raises(OSError, match=f'{second}'):
        write_together({first: 'after', tmp_path / second: 'much too long'})
    assert first.read_text() == 'before' and {*tmp_path.iterdir()} == there


def test_what_interrupts_it_leaves_no_part(tmp_path, monkeypatch):
    path = write_whole(tmp_path / 'file', 'before')

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, 'replace', interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_whole(path, 'after')
    assert path.read_text() == 'before' and list(tmp_path.iterdir()) == [path]


def test_what_a_library_could_not_finish_leaves_the_one_before(tmp_path):
    path = write_whole(tmp_path / 'film.gif', 'before')

    def film(pictures):
        with whole(path) as part:
            assert part.suffix == path.suffix
            part.write_text(''.join(pictures))

    with room_for(10), pytest.raises(OSError, match='File too large') as error:
        film(['much too long'])
    assert error.value.filename == str(path)
    with pytest.raises(ZeroDivisionError):
        film(str(1 // n) for n in (1, 0))
    assert path.read_text() == 'before' and list(tmp_path.iterdir()) == [path]
    film(['af', 'ter'])
    assert path.read_text() == 'after' and list(tmp_path.iterdir()) == [path]
