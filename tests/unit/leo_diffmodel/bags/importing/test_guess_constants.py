# SPDX-License-Identifier: Apache-2.0
"""The head of a log says constants of the robot: lines of the map, in the unit that is near."""

import json

import numpy as np
import pytest
import yaml

from leo_diffmodel.bags.importing.convert import import_logs
from leo_diffmodel.bags.importing.guess import guess_map
from leo_diffmodel.bags.recording import read_bag
from leo_sim.description.robot import load_robot

T = np.arange(100) / 50
RUN = {'time': T.tolist(), 'elbow_pos': np.sin(T).tolist(), 'elbow_goal': np.sin(T).tolist()}


def said(folder, head, robot=None):
    (folder / 'log.json').write_text(json.dumps(head | RUN))
    file = guess_map(folder / 'log.json', folder / 'map.yaml', robot and load_robot(robot), robot)
    return file.read_text()


@pytest.mark.parametrize(
    ('head', 'units'),
    [
        ({'mass': 0.6, 'length': 0.12, 'kp': 400, 'vin': 7.0}, ['kg', 'm', 'V']),
        ({'mass': 600.0, 'length': 120, 'kp': 400, 'vin': 7000}, ['g', 'mm', 'mV']),
    ],
)
def test_a_head_as_bam_has_it(tmp_path, head, units):
    found = yaml.safe_load(said(tmp_path, head, 'xl330_pendulum'))['constants']
    assert [e['unit'] for e in found.values() if 'unit' in e] == units
    bag = import_logs([tmp_path / 'log.json'], tmp_path / 'map.yaml', tmp_path / 'bag')
    known = json.loads(read_bag(bag, load_robot('xl330_pendulum')).metadata['constants'])
    expected = {'links.weight.mass': 0.6, 'links.weight.com_z': -0.12}
    expected |= {'actuators.pivot.position_gain': 1.150952, 'actuators.pivot.supply': 7.0}
    assert known == pytest.approx(expected)


def test_what_no_robot_or_several_places_may_be_is_a_comment(tmp_path):
    text = said(tmp_path, {'mass': 0.6, 'note': 3.0})
    assert '# constants: {?: {column: mass, unit: kg}}  # 0.6: links.LINK.mass' in text
    (tmp_path / 'map.yaml').unlink()
    text = said(tmp_path, {'mass': 0.6, 'kp': 1e9}, 'double_pendulum')
    assert 'constants' not in yaml.safe_load(text) and 'links.upper.mass or links.' in text
