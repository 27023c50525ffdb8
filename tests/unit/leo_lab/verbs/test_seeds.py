# SPDX-License-Identifier: Apache-2.0
"""`leo seeds`: each seed once, by whoever works, as `leo learn` trains it alone."""

import json
import shutil

import pytest
from tests.cluster import local_cluster

from leo_lab.verbs import seeds
from leo_learner.verbs import learn
from leo_msgs_py.errors import UserError

WORDS = ['--', '--robot', 'pendulum', '--steps', '30']


def returns(folder):
    """Test returns by seed, of the lines in a folder."""
    lines = [json.loads(x) for x in (folder / seeds.LINES).read_text().splitlines()]
    return {x['seed']: x['test_return'] for x in lines if 'seed' in x}


def test_seeds_are_those_of_leo_learn_and_none_is_trained_twice(tmp_path, capsys):
    many = tmp_path / 'many'
    assert seeds.main(['--count', '1', '--first-seed', '4', '-o', str(many), *WORDS]) == 0
    shutil.rmtree(many / 'seed_4')
    capsys.readouterr()
    words = ['--count', '2', '--first-seed', '4', '--json', '-o', str(many), *WORDS]
    assert seeds.main(words) == 0
    told = json.loads(capsys.readouterr().out)
    assert told['n'] == 2
    assert [row['seed'] for row in told['rows']] == [4, 5]
    assert not (many / 'seed_4').exists()
    assert learn.main([*WORDS[1:], '--seed', '5', '-o', str(tmp_path / 'alone'), '--json']) == 0
    assert json.loads(capsys.readouterr().out)['test_return'] == returns(many)[5]


def test_a_cluster_trains_the_same_and_a_run_that_was_stopped_goes_on(tmp_path, capsys):
    by_jobs, by_cluster = tmp_path / 'jobs', tmp_path / 'cluster'
    assert learn.main([*WORDS[1:-1], '20', '--seed', '0', '-o', str(by_cluster / 'seed_0')]) == 0
    run = by_cluster / 'seed_0' / learn.RUN
    run.write_text(run.read_text().replace('"steps": 20', '"steps": 30'))
    assert seeds.main(['--count', '2', '-o', str(by_jobs), *WORDS]) == 0
    with local_cluster(2) as cluster:
        words = ['--scheduler', cluster.scheduler_address, '-o', str(by_cluster), *WORDS]
        assert seeds.main(['--count', '2', *words]) == 0
    assert returns(by_jobs) == returns(by_cluster)
    assert 'mean test return of 2 seeds' in capsys.readouterr().out


def test_a_run_that_diverged_is_the_worst(tmp_path, capsys):
    case, line = {'learn': '--robot pendulum --steps 30'}, {'policy': 'p', 'model': 'pendulum'}
    rows = [
        {**case, **line, 'seed': seed, 'seconds': 1.0, 'test_return': value}
        for seed, value in enumerate((None, -300.0))
    ]
    (tmp_path / seeds.LINES).write_text(''.join(json.dumps(x) + '\n' for x in (case, *rows)))
    command = ['--count', '2', '-o', str(tmp_path)]
    assert seeds.main([*command, *WORDS]) == 0
    assert 'least -inf, best -300.0' in capsys.readouterr().out
    assert seeds.main([*command, '--json', *WORDS]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told['median'], told['least'], told['best']) == (None, None, -300.0)


@pytest.mark.parametrize(
    ('words', 'told'),
    [
        (['--count', '0', *WORDS], '--count takes 1 or more'),
        ([*WORDS, '--seed', '3'], '--seed of leo learn cannot be given'),
        ([*WORDS, '--on-robot'], '--on-robot of leo learn cannot be given'),
        ([*WORDS, '--nonsense'], '--nonsense'),
    ],
)
def test_wrong_options_are_told_and_nothing_is_written(tmp_path, words, told):
    with pytest.raises(UserError, match=told):
        seeds.main(['-o', str(tmp_path / 'many'), *words])
    assert not (tmp_path / 'many').exists()


def test_a_folder_of_something_else_is_refused(tmp_path):
    assert seeds.main(['--count', '1', '-o', str(tmp_path), *WORDS]) == 0
    with pytest.raises(UserError, match='is of leo learn --robot pendulum --steps 30; give'):
        seeds.main(['--count', '1', '-o', str(tmp_path), *WORDS[:-1], '40'])
