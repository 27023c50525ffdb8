# SPDX-License-Identifier: Apache-2.0
"""The calibration beside a data set of an SO-101 makes angles of per cent, which a clip tells."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.lerobot_data import JOINTS, write_lerobot
import yaml

from leo_diffmodel.bags.importing.calibration import calibration_beside
from leo_diffmodel.bags.importing.convert import load_map
from leo_diffmodel.bags.importing.guess import guess_map
from leo_diffmodel.bags.importing.tables import episodes_of
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot

RANGE = {'shoulder_pan': (800, 3200), 'gripper': (2000, 3400)}
T = np.arange(90) / 30
COUNTS = {name: np.linspace(low - 50, high + 50, len(T)) for name, (low, high) in RANGE.items()}
COUNT = 2 * np.pi / 4095


def calibration(drive_mode: int = 0) -> dict:
    same = {'id': 1, 'drive_mode': drive_mode, 'homing_offset': -1365}
    ends = RANGE.items()
    return {name: same | {'range_min': low, 'range_max': high} for name, (low, high) in ends}


def logged(name: str, drive_mode: int = 0) -> np.ndarray:
    """What LeRobot writes of counts: per cent of the range, of the gripper from its end."""
    low, high = RANGE[name]
    share = (np.clip(COUNTS[name], low, high) - low) / (high - low)
    if name == 'gripper':
        return 100 - 100 * share if drive_mode else 100 * share
    return (200 * share - 100) * (-1 if drive_mode else 1)


def data_set(tmp_path: Path, values: np.ndarray, robot_type: str = 'so101_follower') -> Path:
    folder = write_lerobot(tmp_path / 'data', [(values, values)])
    info = json.loads((folder / 'meta/info.json').read_text()) | {'robot_type': robot_type}
    (folder / 'meta/info.json').write_text(json.dumps(info))
    return folder


def guessed(folder: Path) -> dict:
    file = guess_map(folder, folder.parent / 'map.yaml', load_robot('so101'), 'so101')
    return yaml.safe_load(file.read_text())


@pytest.mark.parametrize(
    ('robot_type', 'drive_mode', 'place'),
    [
        ('so101_follower', 0, 'my_arm.json'),
        ('so101', 1, 'data/meta/arm.json'),
        ('so100_follower', 1, 'data/calibration/a/x.json'),
        ('so_follower', 0, 'calibration/a.json'),
    ],
)
def test_per_cent_becomes_the_angles_that_the_counts_were(tmp_path, robot_type, drive_mode, place):
    values = np.column_stack([logged(name, drive_mode) for name in JOINTS])
    folder = data_set(tmp_path, values, robot_type)
    (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / place).write_text(json.dumps(calibration(drive_mode)))
    robot = load_robot('so101')
    mapping = load_map(guess_map(folder, tmp_path / 'map.yaml', robot, 'so101'))
    ((_, table),), _ = episodes_of([folder], mapping, join=False)
    q = {name: c.position.values(table, 'position', '') for name, c in mapping.joints.items()}
    goals = mapping.inputs['shoulder_pan']['position'].values(table, 'position', '')
    low, high = RANGE['shoulder_pan']
    expected = COUNT * (np.clip(COUNTS['shoulder_pan'], low, high) - (low + high) / 2)
    np.testing.assert_allclose(q['shoulder_pan'], expected, atol=1e-4)
    np.testing.assert_allclose(goals, expected, atol=1e-4)
    low, high = RANGE['gripper']
    stop = next(joint.limits[0] for joint in robot.joints if joint.name == 'gripper')
    expected = stop + COUNT * (np.clip(COUNTS['gripper'], low, high) - low)
    np.testing.assert_allclose(q['gripper'], expected, atol=1e-4)


def test_degrees_have_the_same_zero_and_the_gripper_is_in_per_cent_still(tmp_path):
    values = np.column_stack([120 * np.sin(T), logged('gripper')])
    folder = data_set(tmp_path, values)
    (tmp_path / 'arm.json').write_text(json.dumps(calibration()))
    joints = guessed(folder)['joints']
    assert joints['shoulder_pan']['position']['unit'] == 'deg'
    assert joints['gripper']['position']['scale'] == pytest.approx(14 * COUNT, rel=1e-5)
    said = yaml.safe_load(guess_map(folder, tmp_path / 'no_model.yaml').read_text())
    assert said['joints']['gripper']['position']['scale'] == pytest.approx(14 * COUNT, rel=1e-5)


def test_beyond_the_range_in_degrees_is_per_cent(tmp_path):
    narrow = calibration()
    narrow['shoulder_pan'] |= {'range_min': 1800, 'range_max': 2400}  # 26 deg to each side
    folder = data_set(tmp_path, np.column_stack([80 * np.sin(T), 50 + T]))
    (tmp_path / 'arm.json').write_text(json.dumps(narrow))
    position = guessed(folder)['joints']['shoulder_pan']['position']
    assert position['scale'] == pytest.approx(3 * COUNT)


def test_what_may_be_either_is_left_open_with_both(tmp_path):
    folder = data_set(tmp_path, np.column_stack([60 * np.sin(T), 50 + T]))
    (tmp_path / 'arm.json').write_text(json.dumps(calibration()))
    assert guessed(folder)['joints']['shoulder_pan']['position']['unit'] == '?'
    assert 'unit: deg, or of per cent scale: 0.0184' in (tmp_path / 'map.yaml').read_text()


def test_without_a_calibration_a_clip_at_100_says_per_cent(tmp_path):
    folder = data_set(tmp_path, np.column_stack([logged(name) for name in JOINTS]))
    assert guessed(folder)['joints']['shoulder_pan']['position']['unit'] == '?'
    text = (tmp_path / 'map.yaml').read_text()
    assert 'exactly 100: per cent of the calibrated range; from stop to stop of so101 sc' in text


def test_a_gripper_at_100_says_nothing_of_the_arm(tmp_path):
    folder = data_set(tmp_path, np.column_stack([60 * np.sin(T), np.clip(80 + 20 * T, 0, 100)]))
    assert 'exactly 100' not in str(guessed(folder)) + (tmp_path / 'map.yaml').read_text()
    (tmp_path / 'map.yaml').unlink()
    (tmp_path / 'arm.json').write_text(json.dumps(calibration()))
    assert guessed(folder)['joints']['shoulder_pan']['position']['unit'] == '?'


def test_a_gripper_in_per_cent_beside_an_arm_in_radians(tmp_path):
    folder = data_set(tmp_path, np.column_stack([np.sin(T), 50 + 10 * T]), 'xarm')
    joints = guessed(folder)['joints']
    assert [joints[name]['position']['unit'] for name in JOINTS] == ['rad', '?']


def test_other_robots_have_no_calibration_of_this_kind(tmp_path):
    folder = data_set(tmp_path, np.column_stack([logged(name) for name in JOINTS]), 'xarm')
    (tmp_path / 'arm.json').write_text(json.dumps(calibration()))
    assert 'arm.json' not in str(guessed(folder)) + (tmp_path / 'map.yaml').read_text()


def test_calibrations_that_differ_are_refused_and_other_files_passed_over(tmp_path):
    (tmp_path / 'data').mkdir()
    for name, content in {'a': '[1]', 'b': '{', 'c': '{"gripper": {"range_min": 1}}'}.items():
        (tmp_path / f'{name}.json').write_text(content)
    assert calibration_beside(tmp_path / 'data', JOINTS) is None
    for drive_mode in (0, 1):
        (tmp_path / f'arm{drive_mode}.json').write_text(json.dumps(calibration(drive_mode)))
    with pytest.raises(UserError, match=r'arm0.json and .*arm1.json are calibrations of these'):
        calibration_beside(tmp_path / 'data', JOINTS)
