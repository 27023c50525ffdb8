# SPDX-License-Identifier: Apache-2.0
"""A folder full of what users get wrong: bags, logs, models, effects."""

import json
from pathlib import Path
import shutil

import numpy as np
import yaml

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.bags.writer import BagWriter
from leo_sim.description.robot import load_robot
from leo_sim.description.robots import LEO
from leo_sim.model import Model
from leo_sim.model.model_file import save_model

FRICTION = {
    'name': 'viscous_friction',
    'where': 'pivot',
    'parameters': {'b': {'value': 1e-5, 'unit': 'N m s/rad'}},
}
COLUMN_MAP = """
robot: pendulum
time: t
joints: {pivot: {position: angle}}
"""
BROKEN_LAW = """
from leo_sim.effects import Effect, Parameter
class Wind(Effect):
    name, family, hook, parameters = 'wind', 'load', 'torque', (Parameter('w', 'N m'),)
    def torque(self, p, q, dq, motor, load):
        raise RuntimeError('no wind today')
"""


def fill(folder: Path) -> Path:
    _bags(folder)
    _models(folder)
    _logs(folder)
    _runs(folder)
    (folder / 'notes.txt').write_text('nothing of use\n')
    (folder / 'list.json').write_text('[]')
    effects = {
        'raises.py': 'raise RuntimeError("out of order")\n',
        'syntax.py': 'def (:\n',
        'imports.py': 'import no_such_module_anywhere\n',
        'none.py': 'x = 1\n',
        'hook.py': BROKEN_LAW.replace("'torque',", "'ground',"),
        'half.py': 'from leo_sim.effects import Effect\nclass Wind(Effect):\n    name = 1\n',
        'broken_law.py': BROKEN_LAW,
        'bounds.py': BROKEN_LAW.replace("'N m')", "'N m', -3.0, 3.0)"),
        'times.py': BROKEN_LAW.replace("'N m')", "'N m', times='stiffness')"),
    }
    for name, text in effects.items():
        (folder / name).write_text(text)
    return folder


def swing(count: int = 600, joint: str = 'pivot') -> Run:
    t = 0.01 * np.arange(count)
    inputs = {joint: {'voltage': np.sign(np.sin(7 * t)), 'enabled': np.ones(count)}}
    return Run(t, [joint], 3 + np.sin(t)[:, None], np.cos(t)[:, None], inputs=inputs)


def _bags(folder: Path) -> None:
    write_runs(folder / 'good', [swing()], {'robot': 'pendulum'})
    write_runs(folder / 'elbow', [swing(joint='elbow')], {})
    nothing = swing()
    write_runs(folder / 'nan', [Run(nothing.t, ['pivot'], nothing.q * np.nan)], {})
    write_runs(folder / 'tiny', [swing(6)], {})
    BagWriter(folder / 'empty', {}).close()
    writer = BagWriter(folder / 'other', {})
    for topic in ('/camera/info', '/chatter'):
        channel = writer.add_topic(topic, 'std_msgs/msg/String')
        writer.write(channel, b'\x00\x01\x00\x00\x02\x00\x00\x00x\x00', 1)
    writer.close()
    (mcap,) = (folder / 'good').glob('*.mcap')
    damaged = bytearray(mcap.read_bytes())
    damaged[64:] = np.random.default_rng(0).bytes(len(damaged) - 64)
    (folder / 'damaged').mkdir()
    (folder / 'damaged' / 'damaged_0.mcap').write_bytes(damaged)
    (folder / 'text.mcap').write_text('this is text, not a bag')
    (folder / 'no_mcap').mkdir()


def _runs(folder: Path) -> None:
    head = 'time [s],pivot [V],torque\n0,1,on\n'
    files = {
        'run': head + '0.1,1,off\n0.2,0,on\n',
        'run_back': head + '0.1,1,off\n0.05,0,on\n',
        'run_nan': head + 'nan,1,off\n0.2,0,on\n',
        'run_torque': head + '0.1,1,free\n0.2,0,on\n',
        'run_unit': head.replace(' [V]', '') + '0.1,1,on\n',
    }
    for name, text in files.items():
        (folder / f'{name}.csv').write_text(text)
    origin = {'robot': 'pendulum', 'date': 'today', 'bags': []}
    told = {'verdict': 'fine', 'effects': [], 'constants': {}, 'not_testable': []}
    told['provenance'] = origin
    (folder / 'other.json').write_text(json.dumps(told))


def _models(folder: Path) -> None:
    save_model(folder / 'model.yaml', Model(load_robot('pendulum')))
    unit = {'b': {'value': 1e-5, 'unit': 'N m'}}
    bad = {
        'unit': {'effects': [{**FRICTION, 'parameters': unit}]},
        'range': {'constants': {'gravity': {'value': 9.8, 'unit': 'm/s2', 'uncertain': [9, 8]}}},
        'law': {'effects': [{'name': 'broken_law.py', 'where': 'pivot'}]},
    }
    for name, content in bad.items():
        (folder / f'bad_{name}.yaml').write_text(yaml.safe_dump({'robot': 'pendulum', **content}))
    (folder / 'broken.yaml').write_text('robot: [pendulum\neffects:\n  - name')
    (folder / 'binary.yaml').write_bytes(b'\xff\xfe\x00')
    (folder / 'half_robot').mkdir()
    (folder / 'half_robot' / 'robot.yaml').write_text('name: half\n')
    leo = yaml.safe_load((LEO / 'robot.yaml').read_text())
    del leo['start_poses']['standing']
    shutil.copytree(LEO, folder / 'no_pose', ignore=shutil.ignore_patterns('robot.yaml'))
    (folder / 'no_pose' / 'robot.yaml').write_text(yaml.safe_dump(leo))
    (folder / 'taken').mkdir()
    (folder / 'taken' / 'model.yaml').write_text('robot: pendulum\n')


def _logs(folder: Path) -> None:
    (folder / 'map.yaml').write_text(COLUMN_MAP)
    (folder / 'map_unit.yaml').write_text(
        COLUMN_MAP.replace('position: angle', 'position: {column: angle, unit: kg}')
    )
    (folder / 'backwards.csv').write_text('t,angle\n0.00,1\n0.02,2\n0.01,3\n0.03,4\n')
    (folder / 'columns.csv').write_text('t,angel\n0,1\n1,2\n')
    (folder / 'words.csv').write_text('t,angle\n0,up\n1,down\n')
    (folder / 'no_rows.csv').write_text('t,angle\n')
    (folder / 'log.csv').write_text('t,angle\n0,1\n1,2\n')
