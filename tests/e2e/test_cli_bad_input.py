# SPDX-License-Identifier: Apache-2.0
"""Whatever a user gets wrong is one clear line and exit status 2, and nothing is written."""

from pathlib import Path

import pytest
from tests.e2e import bad_input

from leo_msgs_py.cli import main

P = ['--model', 'pendulum']
READERS = ('compare', 'explain', 'check', 'watch')
BAGS = {
    'nowhere': ['no bag at nowhere', 'leo bag record'],
    'empty': ['empty', 'robot running'],
    'other': ['/joint_states', '/camera/info', '/chatter', 'topic map'],
    'elbow': ['elbow: joints pivot', 'there are elbow', 'topic map'],
    'nan': ['nan', 'NaN'],
    'damaged': ['damaged is damaged', 'record again'],
    'text.mcap': ['text.mcap', 'not an MCAP'],
    'no_mcap': ['no .mcap file in no_mcap'],
}
MODELS = {
    'nothing.yaml': ['no model file nothing.yaml'],
    'pendulun': ["'pendulun'", 'pendulum?'],
    'bad_unit.yaml': ['bad_unit.yaml', 'effects[0]', "'N m s/rad'", "'N m'"],
    'bad_range.yaml': ['bad_range.yaml', 'gravity', 'uncertain'],
    'bad_law.yaml': ['broken_law.py'],
    'broken.yaml': ['broken.yaml', 'not a YAML file'],
    'binary.yaml': ['binary.yaml', 'not a text file'],
    'half_robot': ['half_robot', 'robot.yaml'],
    'no_mcap': ['no_mcap is no robot folder', 'robot name'],
}
EFFECTS = {
    'nothing.py': ['no effect file nothing.py'],
    'raises.py': ['raises.py', 'out of order'],
    'syntax.py': ['syntax.py', 'line 1'],
    'imports.py': ['imports.py', 'no_such_module_anywhere'],
    'none.py': ['none.py', 'exactly one'],
    'broken_law.py': ['broken_law.py', 'no wind today'],
    'hook.py': ['hook.py', 'hook', "'ground'"],
    'half.py': ['half.py', 'lacks family, hook, parameters'],
    'bounds.py': ['bounds.py', "'w'", 'between low and high'],
    'times.py': ['times.py', "'stiffness'", 'none of the others'],
    'viscos': ['viscos'],
}
LOGS = {
    ('nothing.csv', 'map.yaml'): ['nothing.csv'],
    ('backwards.csv', 'map.yaml'): ['backwards.csv', '0.01'],
    ('columns.csv', 'map.yaml'): ["'angle'", 'angel'],
    ('words.csv', 'map.yaml'): ['words.csv', 'angle'],
    ('no_rows.csv', 'map.yaml'): ['no_rows.csv'],
    ('log.csv', 'nothing.yaml'): ['nothing.yaml'],
    ('log.csv', 'broken.yaml'): ['broken.yaml'],
    ('log.csv', 'map_unit.yaml'): ["'kg'", 'position'],
    ('log.csv', 'model.yaml'): ['model.yaml'],
}
ADD = ['add', 'pendulum', '-o', 'new.yaml']
OTHERS = [
    (['compar', 'good', *P], ["'compare'"]),
    (['compare', 'good'], ['leo compare', '--model', 'leo compare --help']),
    (['compare', 'good', *P, '--colour'], ['leo compare', '--colour']),
    (['compare', 'good', *P, '--step', 'x'], ['leo compare', '--step', "'x'"]),
    (['compare', 'good', *P, '--step', '-1'], ['--step', '-1']),
    (['compare', 'good', *P, '--step', '0.0001'], ['--step']),
    (['compare', 'tiny', *P], ['tiny', '2 s']),
    (['compare', 'good', *P, '--topic-map', 'nothing.yaml'], ['nothing.yaml']),
    (['compare', 'good', *P, '--topic-map', 'broken.yaml'], ['broken.yaml']),
    (['explain', 'good', *P, '-o', 'notes.txt/sub'], ['notes.txt']),
    (['explain', 'good', *P, '--hold-out', 'nowhere'], ['no bag at nowhere']),
    (['explain', 'good', *P, '--hold-out', 'good'], ['good is the same bag as good', 'hold out']),
    (['repair', 'good', 'good', *P, '-o', 'out'], ['the same bag', 'give each once']),
    (['repair', 'good', *P], ['leo repair', '-o']),
    (['repair', 'good', '--model', 'bad_unit.yaml', '-o', 'out'], MODELS['bad_unit.yaml']),
    (['repair', 'good', *P, '-o', 'taken'], ['taken/model.yaml exists', 'another -o']),
    (['import', 'log.csv', '--map', 'map.yaml', '-o', 'good'], ['good', 'exists']),
    (['bag', 'info', 'nowhere'], ['no bag at nowhere']),
    (['bag', 'info', 'other/nothing.mcap'], ['nothing.mcap']),
    (['bag', 'inf', 'good'], ["'inf'", 'info']),
    (['bag', 'play', 'nowhere'], ['no bag at nowhere']),
    (['bag', 'play', 'good', '--rate', '0'], ['--rate 0', 'above 0']),
    (['bag', 'play', 'good', '--wait', '-1'], ['--wait -1', '0 or more']),
    (['bag', 'record', '--colour'], ['--colour']),
    (['reveal', 'nothing.sealed'], ['cannot read nothing.sealed']),
    (['reveal', 'good'], ['good']),
    (['play', 'nothing.safetensors', *P], ['nothing.safetensors']),
    (['play', 'notes.txt', *P], ['notes.txt', 'not a policy file', 'leo learn']),
    (['learn', '--model', 'bad_unit.yaml', '-o', 'run'], ['bad_unit.yaml', "'N m'"]),
    (['learn', '--resume', 'good'], ['good holds no run']),
    (['blind', '--cases', 'x'], ['leo blind', '--cases', "'x'"]),
    (['blind', '--cases', '-1'], ['--cases', '-1']),
    (['blind', '--jobs', '0'], ['--jobs', '0']),
    (['blind', '--robot', 'leo', '--pushed', '1'], ['--pushed takes robots with a fixed base']),
    (['blind', '--robot', 'pendulum', '--faults', '1'], ['--faults and --sound', '--robot']),
    (['blind', '--robot', 'no_pose'], ['no_pose/robot.yaml', 'start_poses', 'standing']),
    (['blind', '-o', 'notes.txt'], ['notes.txt is a file']),
    (['watch', *P], ['leo watch', 'BAG']),
    (['watch', 'tiny', *P], ['tiny', 'record 20 s or more']),
    (['watch', 'good', '--model', 'leo'], ['good: joints base_x', 'there are pivot']),
    (['watch', 'good', *P, '--hold-out', 'good'], ['the same bag', 'hold out']),
    (['watch', '--live', '--model', 'pendulun'], ['pendulum?']),
    (['watch', '--live', *P, '--seconds', '5'], ['--seconds', '5', '10 to 120']),
    (['check', 'good'], ['leo check', '--model']),
    (['check', 'good', 'good', *P], ['the same bag', 'give each once']),
    (['check', 'good', *P, '--effect', 'nothing.py'], ['no effect file nothing.py']),
    (['check', 'good', *P, '--topic-map', 'broken.yaml'], ['broken.yaml']),
    (
        ['compare', 'good', '--model', 'bad_law.yaml', '--effect', 'broken_law.py'],
        ['broken_law.py', 'no wind today'],
    ),
    (['next', 'tiny', *P], ['tiny', '2 s']),
    (['next', 'nowhere', *P], ['no bag at nowhere']),
    (['next', 'good', *P, '-o', 'notes.txt'], ['notes.txt', '.csv']),
    (['next', 'good', *P, '-o', 'no/next.csv'], ['no/next.csv', 'make it first']),
    (['next', 'good', *P, '-o', 'log.csv'], ['log.csv exists', 'no run file']),
    (['datasheet', *P, '--motion', 'model.yaml'], ['model.yaml', '.csv']),
    (['next', 'good', *P, '--seconds', '0'], ['--seconds', '0']),
    (['next', 'good', *P, '--seconds', 'nan'], ['--seconds', 'nan']),
    (['next', 'good', *P, '--explain', 'nothing'], ['nothing', 'leo explain']),
    (['next', 'good', *P, '--explain', 'list.json'], ['list.json is not an explain.json']),
    (['next', 'good', *P, '--explain', 'other.json'], ['other.json is not about good']),
    (['play', 'nothing.csv', *P], ['nothing.csv']),
    (['play', 'log.csv', *P], ['log.csv is no run file', 'leo next']),
    (['play', 'run.csv', '--model', 'torque_pendulum'], ['pivot in V', 'pivot in N m']),
    (['play', 'run_back.csv', *P], ['run_back.csv line 4', '0.1 to 0.05 s']),
    (['play', 'run_nan.csv', *P], ['run_nan.csv line 3', "'nan'"]),
    (['play', 'run_torque.csv', *P], ['run_torque.csv line 3', "'free'", 'on or off']),
    (['play', 'run_unit.csv', *P], ['run_unit.csv', 'pivot [V]']),
    (
        ['play', 'run.csv', '--predict', 'pendulum'],
        ['run.csv was not sent', 'nobody is at a terminal', '--yes'],
    ),
    (['play', 'run.csv', *P, '--predict', 'pendulum'], ['--predict', 'sent to the robot']),
    (['play', 'run.csv', '--collect', '5'], ['--collect', 'run file']),
    ([*ADD], ['--from', 'EFFECT']),
    ([*ADD, '--from', 'nothing.json'], ['nothing.json', 'leo explain']),
    ([*ADD, '--from', 'notes.txt'], ['notes.txt is not JSON']),
    ([*ADD, '--from', 'list.json'], ['list.json is not an explain.json']),
    ([*ADD, 'viscos_friction', 'b=1'], ['viscous_friction?']),
    ([*ADD, 'viscous_friction:knee', 'b=1'], ["'knee'", 'pivot']),
    ([*ADD, 'viscous_friction', 'c=1'], ["'c'", 'it has: b']),
    ([*ADD, 'viscous_friction', 'b'], ["'b'", 'PARAM=VALUE']),
    ([*ADD, 'viscous_friction', 'b=1', 'b=2'], ['given twice']),
    ([*ADD, 'viscous_friction', 'b=nan'], ['viscous_friction.b', 'nan']),
    (['add', 'pendulum', 'viscous_friction', 'b=1', '-o', 'model.yaml'], ['model.yaml exists']),
    ([*ADD[:-1], 'model.yaml/new.yaml', 'viscous_friction', 'b=1'], ['model.yaml/new.yaml']),
    (['run', 'leo_sim', 'robto'], ["'robto'", 'leo_sim robot']),
    (['run', 'leo_sim', 'robot', '--ros-args', '-p', 'robot:=pendulun'], ['pendulum?']),
]
CASES = [
    *(([v, bag, *P, '-o', 'out'], said) for v in READERS for bag, said in BAGS.items()),
    *(([v, 'good', *P, '-o', 'notes.txt'], ['notes.txt is a file']) for v in (*READERS, 'repair')),
    *((['repair', bag, *P, '-o', 'out'], BAGS[bag]) for bag in ('nowhere', 'empty', 'damaged')),
    *((['compare', 'good', '--model', model], said) for model, said in MODELS.items()),
    *((['explain', 'good', *P, '--keep', '--effect', n], said) for n, said in EFFECTS.items()),
    *((['import', log, '--map', map_, '-o', 'new'], said) for (log, map_), said in LOGS.items()),
    *OTHERS,
]


@pytest.fixture(scope='module')
def shop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return bad_input.fill(tmp_path_factory.mktemp('bad'))


def contents(folder: Path) -> dict[Path, bytes]:
    there = [p for p in folder.rglob('*') if '__pycache__' not in p.parts]
    return {p: p.read_bytes() if p.is_file() else b'' for p in there}


@pytest.mark.parametrize(('argv', 'said'), CASES, ids=lambda v: ' '.join(v))
@pytest.mark.usefixtures('domain')
def test_one_line_says_what_is_wrong(argv, said, shop, monkeypatch, capfd):
    monkeypatch.chdir(shop)
    before = contents(shop)
    assert main(list(argv)) == 2
    out, err = capfd.readouterr()
    assert out == ''
    other = ('warning: ', '[INFO]', 'explaining')  # a line of progress on a busy machine
    lines = [line for line in err.splitlines() if not line.startswith(other)]
    assert len(lines) == 1 and lines[0].startswith('leo: error: '), err
    assert [part for part in said if part not in lines[0]] == [], lines[0]
    assert contents(shop) == before
