# SPDX-License-Identifier: Apache-2.0
"""What an import has made is removed again where it does not come to its end, and nothing else."""

from contextlib import suppress
from pathlib import Path

import pytest

from leo_diffmodel.bags.importing.convert import undone_on_error
from leo_diffmodel.verbs import import_logs
from leo_msgs_py.errors import UserError

GOOD, BAD = 't,q\n0,1\n1,2\n', 't,q\n0,1\n1,x\n'


@pytest.fixture
def words(tmp_path, monkeypatch) -> list[str]:
    monkeypatch.chdir(tmp_path)
    for name, text in (
        ('good.csv', GOOD),
        ('bad.csv', BAD),
        ('map.yaml', 'time: t\njoints: {pivot: {position: q}}\n'),
    ):
        Path(name).write_text(text)
    return ['good.csv', 'bad.csv', '--map', 'map.yaml', '--bag-per-log', '-o']


def test_after_an_error_in_the_second_log_the_first_can_be_imported_again(words):
    for _ in range(2):
        with pytest.raises(UserError, match='is not a number'):
            import_logs.main([*words, 'new/bags'])
        assert not Path('new').exists()


def test_what_was_there_before_stays(words):
    Path('bags/other').mkdir(parents=True)
    with pytest.raises(UserError, match='is not a number'):
        import_logs.main([*words, 'bags'])
    assert [path.name for path in Path('bags').iterdir()] == ['other']
    Path('bags/good').mkdir()
    with pytest.raises(UserError, match='exists already'):
        import_logs.main([*words, 'bags'])
    with pytest.raises(UserError, match='exists already'):
        import_logs.main(['good.csv', '--map', 'map.yaml', '-o', 'bags/other'])
    assert sorted(path.name for path in Path('bags').iterdir()) == ['good', 'other']


def test_ctrl_c_after_a_bag_is_written_takes_it_away(words, monkeypatch):
    def interrupted(bag):
        assert bag.exists()
        raise KeyboardInterrupt

    monkeypatch.setattr(import_logs, 'bag_info', interrupted)
    with pytest.raises(KeyboardInterrupt):
        import_logs.main(['good.csv', '--map', 'map.yaml', '-o', 'bag'])
    assert not Path('bag').exists()


def test_a_folder_into_which_others_have_written_stays(tmp_path):
    mine, theirs = tmp_path / 'bags/mine', tmp_path / 'bags/theirs'
    with suppress(KeyboardInterrupt), undone_on_error(tmp_path / 'bags') as made:
        mine.mkdir(parents=True)
        theirs.mkdir()
        made.append(mine)
        raise KeyboardInterrupt
    assert [path.name for path in (tmp_path / 'bags').iterdir()] == ['theirs']
