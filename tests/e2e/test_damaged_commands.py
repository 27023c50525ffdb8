# SPDX-License-Identifier: Apache-2.0
"""Commands on damaged files end soon, without a traceback, and say in one line what is wrong.

LEO_DAMAGED=1000 runs 50, five run by default.
"""

from collections.abc import Callable
import os
from pathlib import Path
import shutil
import subprocess

import numpy as np
import pytest
from tests import damage
from tests.commands import LEO
from tests.damage import Rng
from tests.damage_shop import fill

CASES = 50 if int(os.environ.get('LEO_DAMAGED', '100')) >= 1000 else 5
P = ['--model', 'pendulum']
Spoil = Callable[[Path, Rng], object]
BYTES, YAML, XML = damage.damage_bytes, damage.damage_yaml, damage.damage_xml
COMMANDS: tuple[tuple[list[str], str, Spoil], ...] = (
    (['compare', 'plain', *P], 'plain/plain_0.mcap', BYTES),
    (['bag', 'info', 'plain'], 'plain/plain_0.mcap', BYTES),
    (['bag', 'info', 'zstd'], 'zstd/bag_0.mcap', damage.damage_path),
    (['compare', 'plain', *P, '--topic-map', 'map.yaml'], 'map.yaml', YAML),
    (['compare', 'plain', '--model', 'model.yaml'], 'model.yaml', YAML),
    (['compare', 'plain', '--model', 'robot'], 'robot/robot.yaml', YAML),
    (['compare', 'plain', '--model', 'robot'], 'robot/robot.urdf', XML),
    (['robot', 'init', 'robot/robot.urdf', '-o', 'new'], 'robot/robot.urdf', XML),
    (['import', 'log.csv', '--map', 'columns.yaml', '-o', 'new'], 'columns.yaml', YAML),
    (
        ['add', 'pendulum', '--from', 'explain.json', '-o', 'new.yaml'],
        'explain.json',
        damage.damage_json,
    ),
)


@pytest.fixture(scope='module')
def shop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fill(tmp_path_factory.mktemp('whole'))


@pytest.mark.parametrize('seed', range(CASES))
def test_a_command_on_damaged_files_says_one_line(seed, shop, tmp_path):
    root = Path(shutil.copytree(shop, tmp_path / 'shop'))
    rng = np.random.default_rng([seed, 50])
    argv, victim, spoil = COMMANDS[seed % len(COMMANDS)]
    spoil(root / victim, rng)
    done = subprocess.run([LEO, *argv], cwd=root, capture_output=True, text=True, timeout=300)
    said = [line for line in done.stderr.splitlines() if not line.startswith('warning: ')]
    if done.returncode == 2:
        assert len(said) == 1 and said[0].startswith('leo: error: ') and done.stdout == '', said
    else:
        assert done.returncode in (0, 1) and said == [], (done.returncode, said)
