# SPDX-License-Identifier: Apache-2.0
"""leo explain --each: every bag by itself, taken up where it was left, and who stands out."""

from contextlib import nullcontext
import json

import pytest
from tests.cluster import local_cluster
from tests.searched import among
from tests.simulate import bag, PENDULUM, record, TORQUE

from leo_diffmodel.verbs import explain_each, fleet_table
from leo_diffmodel.verbs.explain_each import unique_names
from leo_msgs_py.cli import main
from leo_msgs_py.errors import UserError
from leo_sim.effects import place
from leo_sim.model import Model

WORDS = ['--each', '--jobs', '1', '--model', 'torque_pendulum']


@pytest.fixture
def bags(tmp_path, monkeypatch):
    among(monkeypatch, Model(TORQUE), 'coulomb_friction', 'viscous_friction', 'torque_scale')
    frictions = {'run_1': 0.1, 'run_2': 0.1, 'run_3': 0.3}
    for seed, (name, c) in enumerate(frictions.items(), start=1):
        placed = place(TORQUE, 'coulomb_friction', 'pivot', c=c)
        bag(tmp_path / name, record(TORQUE, placed, seconds=10, seed=seed))
    return [str(tmp_path / name) for name in frictions]


def test_each_bag_by_itself_and_again_from_where_it_was_left(bags, tmp_path, monkeypatch, capsys):
    out = tmp_path / 'out'
    words = ['-o', str(out)]
    assert main(['explain', *bags[:2], *WORDS, '--why', *words]) == 0
    said = capsys.readouterr().out
    assert all(f'rules of the answer to {name}' in said for name in ('run_1', 'run_2'))
    done, asked = explain_each.explain, []

    def explain(recordings, *rest, **more):
        asked.extend(r.name for r in recordings)
        return done(recordings, *rest, **more)

    monkeypatch.setattr(explain_each, 'explain', explain)
    assert main(['explain', *bags, *WORDS, *words, '--json']) == 0
    found = json.loads(capsys.readouterr().out)
    assert asked == ['run_3'] and [*found['bags']] == ['run_1', 'run_2', 'run_3']
    (row,) = found['figures']
    assert row['what'] == 'coulomb_friction:pivot' and row['stand_out'] == ['run_3']
    assert row['median'] == pytest.approx(0.1, rel=0.06)
    assert row['robots']['run_3']['value'] == pytest.approx(0.3, rel=0.05)
    assert json.loads((out / 'fleet.json').read_text())['figures'] == found['figures']
    told = json.loads((out / 'run_1/explain.json').read_text())
    (out / 'run_1/explain.json').write_text(json.dumps(told | {'provenance': {}}))
    main(['explain', bags[0], *WORDS, *words])
    main(['explain', bags[0], *WORDS, *words, '--from', '1'])
    assert asked == ['run_3', 'run_1', 'run_1']


def test_where_the_time_is_over_each_bag_has_the_best_so_far(bags, tmp_path, capsys):
    words = ['--within', '0.001s', '-o', str(tmp_path / 'out'), '--json']
    assert main(['explain', *bags[:2], *WORDS, *words]) == 1
    told = json.loads(capsys.readouterr().out)['bags']
    assert [answer['complete'] for answer in told.values()] == [False, False]
    assert [path.name for path in (tmp_path / 'out/run_1').iterdir()] == ['explain.json']


@pytest.mark.parametrize('other', ['--hold-out', '--write-effect'])
def test_each_goes_alone(tmp_path, capsys, other):
    words = ['explain', 'a', '--each', other, str(tmp_path / 'b.py'), '--model', 'pendulum']
    assert main(words) == 2
    assert other in capsys.readouterr().err


@pytest.mark.parametrize('by', ['--jobs', '--scheduler'])
def test_what_cannot_be_read_or_written_is_said_and_all_else_is_told(tmp_path, capsys, by):
    paths = [bag(tmp_path / name, record(PENDULUM, seconds=1.0)) for name in ('run', 'full')]
    (tmp_path / 'out/full/report.html').mkdir(parents=True)
    words = ['explain', *map(str, paths), str(tmp_path / 'none'), '--each', '--model', 'pendulum']
    with local_cluster(2) if by == '--scheduler' else nullcontext() as cluster:
        workers = cluster.scheduler_address if cluster else '2'
        assert main([*words, by, workers, '-o', str(tmp_path / 'out')]) == 2
    said = capsys.readouterr()
    assert '2 bags: 2 untestable\nuntestable: run, full\n' in said.out
    errors = [line for line in said.err.splitlines() if line.startswith('leo: error: ')]
    assert len(errors) == 2 and 'report.html' in errors[0] and 'none' in errors[1]
    assert json.loads((tmp_path / 'out/run/explain.json').read_text())['verdict'] == 'untestable'


def test_names_of_bags_tell_them_apart(tmp_path):
    paths = [str(tmp_path / 'a' / 'bag'), str(tmp_path / 'b' / 'bag')]
    assert unique_names(paths) == ['a_bag', 'b_bag']
    assert unique_names(['/bag', '/b/bag']) == ['bag', 'b_bag']
    with pytest.raises(UserError, match='a/bag is the same bag again'):
        unique_names([*paths, paths[0]])


def test_a_wide_table_leaves_figures_out_and_no_robot_and_cuts_no_word(capsys, monkeypatch):
    monkeypatch.setenv('COLUMNS', '80')
    robots = {f'robot_{n}': {'value': 0.1, 'ci95': [0.09, 0.11]} for n in range(40)}
    figure = {'parameter': 'c', 'unit': 'N m', 'median': 0.1, 'robots': robots}
    rows = [{**figure, 'what': 'coulomb_friction:pivot', 'stand_out': ['robot_39']}]
    rows += [{**figure, 'what': f'coulomb_friction:joint_{n}', 'stand_out': []} for n in range(3)]
    fleet_table.show({name: {'verdict': 'unknown'} for name in robots}, rows, None)
    said = capsys.readouterr().out
    lines = [line.split()[1] for line in said.splitlines() if '[0.09, 0.11]' in line]
    assert lines[:2] == ['robot_39', 'robot_0'] and len(lines) == 40 + 1  # the one that stands out
    assert max(map(len, said.splitlines())) <= 80
    assert 'left out for want of width: coulomb_friction:joint_' in said
    assert '* 0.1 [0.09, 0.11]' in said and 'robot_39 stands out' in said
