# SPDX-License-Identifier: Apache-2.0
"""One of everything a user may damage: bags, maps, models, robots, logs, explanations, runs."""

from dataclasses import replace
import json
from pathlib import Path
import shutil

from mcap.writer import CompressionType
import numpy as np
from tests.messages import bag_of, states

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_learner.ddpg.agent import Training
from leo_learner.ddpg.configs import RECOMMENDED
from leo_learner.environment.env import ModelEnv
from leo_learner.learning.checkpoint import save_checkpoint
from leo_learner.learning.policy import save_policy
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

PENDULUM = load_robot('pendulum')
MAP = """
topics: {joint_states: /joint_states, applied: /robot/applied_voltage}
joints: {pivot: {name: pivot, sign: -1, offset: 0.1}}
input: auto
interface: voltage
command_order: [pivot]
hold: next
"""
MODEL = """
robot: pendulum
constants:
  actuators.pivot.resistance: {value: 9.0, unit: ohm, uncertain: [8, 11]}
effects:
- {name: viscous_friction, where: pivot, parameters: {b: {value: 1.0e-5, unit: N m s/rad}}}
- name: command_delay
  where: all
  parameters: {delay: {value: 0.01, unit: s, ci95: [0.005, 0.015]}}
history: [{added: viscous_friction, by: hand}]
"""
COLUMNS = """
robot: pendulum
columns: {volts: duty * 12}
time: {column: t, unit: ms}
joints: {pivot: {position: {column: angle, unit: deg, sign: -1, offset: 0.1}, velocity: speed}}
inputs: {pivot: {voltage: {expression: volts * 1}, enabled: on}}
"""
EXPLANATION = {
    'verdict': 'named',
    'effects': [
        {
            'name': 'viscous_friction',
            'where': 'pivot',
            'error_before': 0.1,
            'error_after': 0.01,
            'parameters': {'b': {'value': 1e-5, 'unit': 'N m s/rad', 'ci95': [0.9e-5, 1.1e-5]}},
            'confusable_with': [],
        }
    ],
    'not_testable': [],
    'constants': {'actuators.pivot.resistance': {'value': 9.0, 'unit': 'ohm'}},
    'provenance': {'robot': 'pendulum', 'bags': [{'path': 'a', 'sha256': 'b'}], 'date': 'today'},
}
LAW = EXPLANATION | {
    'verdict': 'unknown',
    'effects': [],
    'unknown': {
        'joint': 'pivot',
        'source': 'found.py',
        'error_before': 0.1,
        'error_after': 0.01,
        'model': {key: EXPLANATION[key] for key in ('effects', 'constants')},
    },
}


def fill(root: Path) -> Path:
    """Write one of each, whole."""
    write_runs(root / 'plain', [_swing(), _swing()], {'robot': 'pendulum'})
    for compression in (CompressionType.ZSTD, CompressionType.LZ4):
        _chunked(root / compression.name.lower(), compression)
    (root / 'map.yaml').write_text(MAP)
    (root / 'model.yaml').write_text(MODEL)
    (root / 'columns.yaml').write_text(COLUMNS)
    (root / 'explain.json').write_text(json.dumps(EXPLANATION))
    (root / 'law.json').write_text(json.dumps(LAW))
    rows = [f'{10 * k},{k % 90},{k % 7},{0.1 * (k % 5)},1' for k in range(200)]
    (root / 'log.csv').write_text('t,angle,speed,duty,on\n' + '\n'.join(rows) + '\n')
    shutil.copytree(PENDULUM.folder, root / 'robot')
    _trained(root / 'run')
    return root


def training() -> Training:
    """A short training on the pendulum, before its first step."""
    config = replace(RECOMMENDED, hidden=(8, 8), warm_up=50, episode_steps=50)
    return Training(ModelEnv(Model(PENDULUM)), config, seed=0)


def _trained(folder: Path) -> None:
    done = training()
    done.run(150)
    save_checkpoint(folder, done)
    save_policy(folder / 'policy.safetensors', done, PENDULUM)


def _swing(count: int = 300) -> Run:
    t = 0.01 * np.arange(count)
    inputs = {'pivot': {'voltage': np.sign(np.sin(7 * t)), 'enabled': np.ones(count)}}
    return Run(t, ['pivot'], np.sin(t)[:, None], np.cos(t)[:, None], inputs=inputs)


def _chunked(folder: Path, compression: CompressionType) -> None:
    """A bag of another writer: small compressed chunks, no metadata.yaml."""
    t = 0.01 * np.arange(400)[:, None]
    swing = states(400, ['pivot'], np.sin(t), np.cos(t))
    bag = bag_of(folder, *swing, compression=compression, chunk_size=2000)
    bag.rename(folder / 'bag_0.mcap')
