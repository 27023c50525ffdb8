# SPDX-License-Identifier: Apache-2.0
"""Recordings of one rig with several payloads: known from their logs, or refitted in each."""

from dataclasses import replace
import json
from pathlib import Path

import numpy as np
import pytest
from tests.places import REAL_DATA
from tests.searched import among
from tests.simulate import bag, DT, of_robot, record, TORQUE
import yaml

from leo_diffmodel.add.patch import from_data
from leo_diffmodel.bags.importing.convert import import_logs
from leo_diffmodel.bags.recording import Episode, read_bag, Recording
from leo_diffmodel.compare.comparison import compare
from leo_diffmodel.compare.conditions import carried
from leo_diffmodel.compare.known import with_known
from leo_diffmodel.compare.noise import short_windows
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.windows import cut
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.problem.candidates import candidates, uncertain
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.likelihood import excess
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.select.evidence import _moves
from leo_diffmodel.explain.settings import SETTINGS
from leo_diffmodel.results import Explanation
from leo_msgs_py.cli import main
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.batch import rollout
from leo_sim.model.model_file import load_model, save_model

BOB, ARM = 'links.bob.mass', load_robot('double_pendulum')
MASSES = {'run_1': 0.676, 'run_2': 1.3}
FRICTION = 0.05
ENTRY = {'value': 0.676, 'unit': 'kg', 'uncertain': [0.1, 3.0], 'per_recording': True}
FILE = {'robot': 'torque_pendulum', 'constants': {BOB: ENTRY}}


def swung(mass: float, seed: int, seconds: float = 8.0, friction: float = FRICTION) -> Recording:
    placed = place(TORQUE, 'viscous_friction', 'pivot', b=friction)
    found = record(TORQUE, placed, seconds=seconds, seed=seed, constants={BOB: mass})
    return replace(found, path=Path(f'run_{seed}'), sha256=str(seed))


def uncertain_mass(per_recording: bool) -> Model:
    mass = replace(TORQUE.constants[BOB], uncertain=(0.1, 3.0), per_recording=per_recording)
    return Model(TORQUE.with_constants({BOB: mass}))


def runs(**of_runs: float) -> list[Recording]:
    seconds = of_runs.pop('seconds', 8.0)
    return [swung(mass, int(name[-1]), seconds, **of_runs) for name, mass in MASSES.items()]


def written(folder: Path, content: dict) -> Path:
    path = folder / 'model.yaml'
    path.write_text(yaml.safe_dump(content))
    return path


# Windows take the constants of their own recording


def arm_run(name: str, seed: int) -> Recording:
    q, dq, inputs = np.random.default_rng(seed).normal(size=(3, 100, 2))
    episode = Episode(DT * np.arange(100), q, dq, inputs, np.ones((100, 2), dtype=bool))
    return of_robot(ARM, episode, name=name)


PATHS = BOB, 'actuators.pivot.rotor_inertia', 'joints.pivot.damping', 'gravity'
CASES = [
    *((TORQUE, path, lambda: runs(seconds=3.0)) for path in PATHS),
    (ARM, f'links.{ARM.joints[-1].child}.mass', lambda: [arm_run(name, 1) for name in MASSES]),
]
IDS = [f'{robot.name}-{path}' for robot, path, _ in CASES]


@pytest.mark.parametrize(('robot', 'path', 'recorded'), CASES, ids=IDS)
def test_every_subset_of_windows_has_its_own_recordings_constants(robot, path, recorded):
    usual = robot.constants[path].value
    values = {'run_1': 0.01 + 0.8 * usual, 'run_2': 0.02 + 1.4 * usual}
    model, recordings = Model(robot, by_recording={path: values}), recorded()
    windows = cut(recordings, 0.1, history=0.05)
    some = windows.take(np.random.default_rng(0).permutation(windows.count)[:9])
    assert set(some.source) == {0, 1}
    start = some.measured[:, 0] + np.array([0.0, 1e-3])[:, None, None]
    found = predict(model, some, start)
    for name, value in values.items():
        mine = some.of(name)
        alone = Model(robot, constants={path: value})
        expected = predict(alone, some.take(mine), start[:, mine])
        assert found[:, mine] == pytest.approx(expected, abs=1e-12)
        assert carried(some, model)[mine] == pytest.approx(carried(some.take(mine), alone))
    for recording, short in zip(recordings, short_windows(recordings), strict=True):
        alone = Model(robot, constants={path: values[recording.name]})
        first = short.measured[:, 0]
        assert predict(model, short, first) == pytest.approx(predict(alone, short, first))


def test_several_models_at_once_each_with_the_constants_of_its_windows():
    path = CASES[-1][1]
    masses = np.array([0.5, 0.7, 0.9])
    model = Model(
        ARM,
        constants={'gravity': np.array([9.0, 9.5, 9.8])[:, None, None]},
        by_recording={path: {'a': masses[:, None, None], 'b': 0.3}},
    )
    rng = np.random.default_rng(0)
    q, dq, inputs = rng.normal(size=(2, 2)), rng.normal(size=(2, 2)), rng.normal(size=(2, 5, 2))
    found, _ = rollout(model.of_recordings(('a', 'b'), np.array([1, 0])), q, dq, inputs, 0.01)
    for s, (mass, gravity) in enumerate(zip(masses, (9.0, 9.5, 9.8), strict=True)):
        for w, value in enumerate((0.3, mass)):
            alone = Model(ARM, constants={path: value, 'gravity': gravity})
            one, _ = rollout(alone, q[[w]], dq[[w]], inputs[[w]], 0.01)
            assert found[s, w] == pytest.approx(one[0], abs=1e-12)


def test_without_such_constants_nothing_changes():
    model = uncertain_mass(per_recording=False)
    assert model.of_recordings(('run_1',), np.zeros(4, dtype=int)) is model
    recordings = runs(seconds=3.0)
    assert with_known(model, recordings) is model
    assert [c.recording for c in uncertain(model, ('run_1', 'run_2'))] == ['']


def test_own_constants_are_differentiated_at_once():
    """Their columns are those of one at a time, and 0 in the windows of other recordings."""
    model, recordings = uncertain_mass(per_recording=True), runs(seconds=3.0)
    windows, sigma = cut(recordings, 0.1), np.full((2, 2), 1e-3)
    hypothesis = Hypothesis(constants=uncertain(model, ('run_1', 'run_2')))
    theta, start = np.array([0.6, 1.2]), windows.measured[:, 0]
    assert hypothesis.together == [[0, 1]]
    problem = Problem(model, windows, sigma, np.ones(windows.count, bool), SETTINGS)
    columns = problem.linearised(hypothesis, theta, start).by_theta
    for i, name in enumerate(('run_1', 'run_2')):
        alone = Hypothesis(constants=(replace(hypothesis.constants[i], recording=''),))
        mine = windows.of(name)
        part = problem.take(np.flatnonzero(mine))
        one = part.linearised(alone, theta[[i]], start[mine]).by_theta
        assert columns[mine, :, i] == pytest.approx(one[..., 0])
        assert not columns[~mine, :, i].any()


def test_a_recording_left_out_finds_its_own_constant_anew():
    """No other recording tells it, so leaving its recording out is no reason to move it."""
    recordings = [swung(0.5 + 0.1 * seed, seed, 3.0, friction=0.0) for seed in range(1, 6)]
    problem = pose(recordings, (), uncertain_mass(per_recording=True)).problem
    fitted = fit(problem, Hypothesis(constants=uncertain(problem.base, problem.trained)))
    assert fitted.theta == pytest.approx([0.6, 0.7, 0.8, 0.9, 1.0], rel=0.02)
    train = problem.train
    data = fitted.residual[train], fitted.columns[train], problem.fold[train]
    moves = _moves(fitted, *data, problem.numerics)
    assert len(moves) == 5
    assert np.array(list(moves.values())) == pytest.approx(0.0, abs=1e-3)


# Refitted in each recording


@pytest.fixture(scope='module')
def explained():
    """Two payloads to learn from, a third held out; all with a bearing no model knows of."""
    return explain(runs(), uncertain_mass(per_recording=True), [swung(0.9, 3)])


def test_each_recordings_payload_is_found_beside_the_hidden_effect(explained):
    assert explained.verdict == 'named'
    (effect,) = explained.effects
    assert (effect['name'], effect['where']) == ('viscous_friction', 'pivot')
    assert effect['parameters']['b']['value'] == pytest.approx(FRICTION, rel=0.05)
    row = explained.constants[BOB]
    for name, mass in MASSES.items():
        assert row['recordings'][name]['value'] == pytest.approx(mass, rel=0.02)
    assert row['unit'] == 'kg' and row['ci95'][0] < 0.676 < 1.3 < row['ci95'][1]
    assert Explanation.of(explained.to_json(), explained.model).constants[BOB].recordings


def test_a_held_out_recording_tells_its_payload_by_one_half_and_is_judged_by_the_other(explained):
    problem = explained.search.problem
    assert problem.trained == ('run_1', 'run_2')
    assert problem.telling.any() and problem.judged.any()
    assert not (problem.telling & problem.judged).any()
    assert set(problem.windows.source[problem.telling | problem.judged]) == {2}
    assert explained.constants[BOB]['recordings']['run_3']['value'] == pytest.approx(0.9, rel=0.03)
    after, floor = (explained.errors['one_step'][name] for name in ('after', 'noise_floor'))
    assert np.less(after, 1.3 * np.array(floor)).all()
    assert explained.effects[0]['gain_held_out'] > 100


@pytest.mark.parametrize(('per_recording', 'noise_is_left'), [(True, True), (False, False)])
def test_one_value_for_all_payloads_fails(per_recording, noise_is_left):
    model = uncertain_mass(per_recording)
    problem = pose(runs(), (), model).problem
    (friction,) = (c for c in candidates(model) if c.label == 'viscous_friction:pivot')
    right = Hypothesis((friction,), uncertain(model, problem.trained))
    size = excess(fit(problem, right).residual[problem.train], 2)
    assert (size < 1.2) is noise_is_left and (size > 3.0) is not noise_is_left


def test_what_was_found_goes_into_a_model_file_and_back(explained, tmp_path):
    model = load_model(written(tmp_path, FILE))
    told = json.loads(json.dumps(explained.to_json()))
    changed, history = from_data(model, told, 'explain.json')
    path = save_model(tmp_path / 'repaired.yaml', changed, history)
    entry = yaml.safe_load(path.read_text())['constants'][BOB]
    assert entry['per_recording'] and entry['uncertain'] == [0.1, 3.0]
    assert entry['value'] == 0.676  # a recording that is not listed: as the file had it
    assert list(entry['recordings']) == ['run_1', 'run_2', 'run_3']
    again = load_model(path)
    assert again.by_recording == changed.by_recording
    starts = {c.recording: c.value for c in uncertain(again, ('run_2', 'run_9'))}
    assert starts == {'run_2': entry['recordings']['run_2'], 'run_9': 0.676}
    told = compare([swung(1.3, 2, 4.0)], again).data
    assert told['budget']['unexplained'] < 0.01
    other = compare([swung(1.3, 2, 4.0)], model).data
    assert told['provenance']['model_sha256'] != other['provenance']['model_sha256']


def test_a_report_lists_the_constants_of_each_recording(explained):
    from leo_diffmodel.report.sections.hypotheses import section

    told = explained.effects, explained.hypotheses, explained.constants
    rows = section(*told, 1.0, '', SETTINGS.gates).values['constants']
    names = [f'{BOB} of {name}' for name in ('run_1', 'run_2', 'run_3')]
    assert [row.split(' = ')[0] for row in rows] == names


# Known of a recording


def knowing(recording: Recording, **constants: float) -> Recording:
    told = json.dumps({path.replace('__', '.'): value for path, value in constants.items()})
    return replace(recording, metadata={'constants': told})


def test_what_a_recording_knows_takes_the_place_of_the_models_value():
    recordings = [knowing(r, links__bob__mass=MASSES[r.name]) for r in runs(seconds=4.0)]
    model = Model(TORQUE, [place(TORQUE, 'viscous_friction', 'pivot', b=FRICTION)])
    knows, plain = compare(recordings, model).data, compare(runs(seconds=4.0), model).data
    assert knows['budget']['unexplained'] < 0.01 < 0.05 < plain['budget']['unexplained']
    assert knows['provenance']['bags'][1]['constants'] == {BOB: 1.3}
    assert 'constants' not in plain['provenance']['bags'][1]


@pytest.mark.parametrize('per_recording', [True, False])
def test_what_is_known_is_not_refitted(per_recording):
    model, (light, heavy) = uncertain_mass(per_recording), runs(seconds=3.0)
    one = with_known(model, [light, knowing(heavy, links__bob__mass=1.3)])
    assert one.by_recording == {BOB: {'run_2': 1.3}}
    names = ['run_1'] if per_recording else ['']
    assert [c.recording for c in uncertain(one, ('run_1', 'run_2'))] == names
    both = with_known(one, [knowing(light, links__bob__mass=0.676)])
    assert uncertain(both, ('run_1', 'run_2')) == ()


def test_a_value_as_the_model_has_it_changes_nothing():
    recordings = [knowing(r, links__bob__mass=TORQUE.constants[BOB].value) for r in runs()]
    assert with_known(Model(TORQUE), recordings).by_recording == {}


def test_a_known_payload_is_known_in_held_out_recordings_too():
    recordings = [knowing(r, links__bob__mass=MASSES[r.name]) for r in runs()]
    model = with_known(uncertain_mass(per_recording=True), recordings)
    problem = pose(recordings[:1], recordings[1:], model).problem
    assert problem.telling is None
    assert (problem.windows.source[problem.judged] == 1).all()


@pytest.mark.parametrize(
    ('constants', 'said'),
    [
        ('{"links.bob.mas": 1}', "no 'links.bob.mas'; did you mean links.bob.mass?"),
        ('[1]', 'expected {path: value} as JSON'),
        ('{"links.bob.mass": "heavy"}', 'expected {path: value} as JSON'),
    ],
)
def test_metadata_that_cannot_be_is_one_line(constants, said):
    recording = replace(runs(seconds=3.0)[0], metadata={'constants': constants})
    with pytest.raises(UserError, match='run_1') as error:
        compare([recording], Model(TORQUE))
    assert said in str(error.value) and '\n' not in str(error.value)


def test_on_a_ground_bags_that_know_the_same_are_one_value():
    torso = knowing(runs(seconds=3.0)[0], links__torso__mass=1.25)
    leo, other = Model('leo'), replace(torso, path=Path('run_2'))
    assert with_known(leo, [torso, other]).constants['links.torso.mass'] == 1.25
    heavier = replace(other, metadata={'constants': '{"links.torso.mass": 1.5}'})
    with pytest.raises(UserError, match='leo stands on a ground'):
        with_known(leo, [torso, heavier])


def test_a_report_says_what_a_bag_knew():
    from leo_diffmodel.report.sections.origin import _bag

    told = _bag(knowing(runs(seconds=3.0)[0], links__bob__mass=1.3), '')
    assert told['constants'] == [f'{BOB} = 1.30']


def test_recordings_are_told_apart_by_name():
    light, heavy = runs(seconds=3.0)
    twins = [light, replace(heavy, path=Path('elsewhere/run_1'))]
    with pytest.raises(UserError, match=r'have one name.*rename one of them'):
        explain(twins, uncertain_mass(per_recording=True))
    assert with_known(Model(TORQUE), twins).by_recording == {}


# Model files


ITS_OWN = {'per_recording': True, 'uncertain': [0.1, 1]}
FAR = ITS_OWN | {'recordings': {'run_1': 2.0}}
ON_GROUND = 'leo stands on a ground'


@pytest.mark.parametrize(
    ('robot', 'path', 'given', 'said'),
    [
        ('torque_pendulum', BOB, {'per_recording': True}, 'uncertain: [low, high]'),
        ('torque_pendulum', 'links.bop.mass', ITS_OWN, "no constant 'links.bop.mass'"),
        ('torque_pendulum', BOB, FAR, 'outside its uncertain range'),
        ('torque_pendulum', BOB, {'recordings': {'run_1': 'heavy'}}, 'recordings.run_1'),
        ('torque_pendulum', BOB, {'recording': {'run_1': 1.0}}, 'unknown key'),
        ('leo', 'links.torso.mass', ITS_OWN, ON_GROUND),
        ('leo', 'links.torso.mass', {'recordings': {'run_1': 1.0}}, ON_GROUND),
    ],
)
def test_a_wrong_model_file_is_one_line(tmp_path, robot, path, given, said):
    content = {'robot': robot, 'constants': {path: {'value': 0.9, 'unit': 'kg', **given}}}
    with pytest.raises(UserError) as error:
        load_model(written(tmp_path, content))
    assert said in str(error.value) and '\n' not in str(error.value)


def test_known_values_in_a_model_file_hold_and_stay(tmp_path):
    entry = {'value': 0.676, 'unit': 'kg', 'recordings': {'run_2': 1.3}}
    model = load_model(written(tmp_path, {'robot': 'torque_pendulum', 'constants': {BOB: entry}}))
    assert uncertain(model, ('run_1', 'run_2')) == ()
    assert model.of_recordings(('run_2',)).constants[BOB] == 1.3
    assert model.constants[BOB] == 0.676
    saved = save_model(tmp_path / 'again.yaml', model)
    assert yaml.safe_load(saved.read_text())['constants'][BOB] == entry


# Imported logs

MAP = {
    'robot': 'torque_pendulum',
    'time': 't',
    'joints': {'pivot': {'position': 'q'}},
    'inputs': {'pivot': {'effort': 'u'}},
    'constants': {BOB: {'column': 'payload', 'unit': 'g'}},
}


def rows(**more: float) -> list[dict]:
    return [{'t': 0.01 * k, 'q': 0.1 * k, 'u': 0.0, **more} for k in range(50)]


def csv(**more: float) -> str:
    table = rows(**more)
    return '\n'.join([','.join(table[0]), *(','.join(map(str, row.values())) for row in table)])


LOGS = [
    ('head.json', {'records': 'entries'}, {'payload': 500, 'motor': 'x', 'entries': rows()}),
    ('deep.json', {'records': 'run.entries'}, {'run': {'payload': 500, 'entries': rows()}}),
    ('rows.json', {}, rows(payload=500)),
    (
        'paths.json',
        {'fields': {'t': 'run.t', 'q': 'run.q', 'u': 'run.u', 'payload': 'payload'}},
        {'payload': 500, 'run': {n: [r[n] for r in rows()] for n in 'tqu'}},
    ),
    (
        'runs.json',
        {'fields': {**{n: f'runs[*].{n}' for n in 'tqu'}, 'payload': 'runs[*].payload'}},
        {'runs': [{'payload': 500} | {n: [r[n] for r in rows()] for n in 'tqu'}] * 2},
    ),
    ('table.csv', {}, csv(payload=500)),
]


@pytest.mark.parametrize(('name', 'where', 'content'), LOGS, ids=[name for name, *_ in LOGS])
def test_a_map_brings_what_a_log_knows_into_the_bag(tmp_path, capsys, name, where, content):
    log, column_map = tmp_path / name, tmp_path / 'map.yaml'
    log.write_text(content if isinstance(content, str) else json.dumps(content))
    column_map.write_text(yaml.safe_dump(MAP | where))
    assert main(['import', str(log), '--map', str(column_map), '-o', str(tmp_path / 'run')]) == 0
    assert f'{BOB} = 0.5' in capsys.readouterr().out
    recording = read_bag(tmp_path / 'run', 'torque_pendulum')
    assert recording.constants == {BOB: pytest.approx(0.5)}
    model = with_known(Model(TORQUE), [recording])
    assert model.by_recording == {BOB: {'run': pytest.approx(0.5)}}


NO_UNIT = "'mm' is no unit of links.bob.mass; give it in kg"


@pytest.mark.parametrize(
    ('change', 'payloads', 'said'),
    [
        ({'constants': {BOB: 'paylod'}}, [0.5], "no column 'paylod' for links.bob.mass"),
        ({'constants': {'links.bop.mass': 'payload'}}, [0.5], "no 'links.bop.mass'"),
        ({'constants': {BOB: {'column': 'payload', 'unit': 'mm'}}}, [0.5], NO_UNIT),
        ({'constants': {BOB: 'q'}}, [0.5], 'goes from 0 to 4.9'),
        ({'constants': {BOB: {'expression': '0 * q / 0'}}}, [0.5], 'no number for'),
        ({}, [500, 900], 'bag of its own (--bag-per-log)'),
        ({'robot': None}, [500], 'add robot: NAME'),
    ],
)
def test_a_map_or_log_that_cannot_be_is_one_line(tmp_path, capsys, change, payloads, said):
    column_map, paths = tmp_path / 'map.yaml', []
    column_map.write_text(yaml.safe_dump(MAP | change))
    for number, payload in enumerate(payloads):
        paths.append(tmp_path / f'{number}.csv')
        paths[-1].write_text(csv(payload=payload))
    words = ['import', *map(str, paths), '--map', str(column_map), '-o', str(tmp_path / 'run')]
    assert main(words) == 2
    error = capsys.readouterr().err
    assert said in error and error.count('\n') == 1
    assert not (tmp_path / 'run').exists()


LOGS = REAL_DATA / 'bam_xl330'


@pytest.mark.skipif(not LOGS.is_dir(), reason='needs ../shared/data/bam_xl330')
def test_the_head_of_a_real_log_says_mass_and_length(tmp_path):
    log = next(iter(sorted(LOGS.glob('*.json'))))
    folder = import_logs([log], 'bam_xl330', tmp_path / 'run')
    recording = read_bag(folder, 'servo_pendulum')
    assert recording.constants == {'links.weight.mass': 0.49, 'links.weight.com_z': -0.1}
    assert with_known(Model('servo_pendulum'), [recording]).by_recording == {}


def test_leo_explain_prints_the_constants_of_each_recording(tmp_path, capsys, monkeypatch):
    bags = [str(bag(tmp_path / r.name, r)) for r in runs(seconds=6.0)]
    file = str(written(tmp_path, FILE))
    among(monkeypatch, load_model(file), 'viscous_friction')
    main(['explain', *bags, '--model', file])
    said = capsys.readouterr().out
    assert f'{BOB}: 0.6' in said and 'in run_1, 1.' in said
