# SPDX-License-Identifier: Apache-2.0
"""The calibration of SO-100 and SO-101 arms next to a LeRobot data set: angles of its numbers.

    {"shoulder_pan": {"id": 1, "drive_mode": 0, "homing_offset": -1365,
                      "range_min": 746, "range_max": 3477}, ...}

LeRobot logs degrees from the middle of the calibrated range, or per cent of it: -100 to 100, of
the gripper 0 to 100 in either case. Numbers in per cent end at exactly 100.

Source: huggingface/lerobot, src/lerobot/motors/motors_bus.py (_normalize), commit 049856c7.
"""

from collections.abc import Iterable, Mapping
import json
import math
from pathlib import Path
import re

from pydantic import BaseModel, ValidationError

from leo_msgs_py.errors import UserError

from .log_format import read_log_text

COUNT = 2 * math.pi / 4095  # rad for one count as LeRobot has it: the resolution 4096 less one
GRIPPER = 'gripper'
ARM = re.compile(r'so(_?arm)?(10[01])?(_follower)?')  # what `robot_type` of these arms is

BEYOND = 5.0  # a calibration that was moved by hand misses a stop by less than this [deg]
_PLAIN = {'sign': 1, 'scale': 1.0, 'offset': 0.0}  # what a map need not say


class Motor(BaseModel):
    """One motor's calibration [counts]; a drive_mode of 1 turns the sign of per cent."""

    drive_mode: int = 0
    range_min: float
    range_max: float

    @property
    def degrees(self) -> float:
        """Half of the calibrated range [deg]."""
        return math.degrees(COUNT) * (self.range_max - self.range_min) / 2

    def per_cent(self, from_end: bool, end: float = 0.0) -> dict[str, float]:
        """Return what makes angles of per cent from the middle, or an end that is `end` [rad]."""
        reach = COUNT * (self.range_max - self.range_min)
        zero = end + (reach if self.drive_mode else 0.0) if from_end else 0.0
        scale = _short(reach / (100 if from_end else 200))
        said = {'sign': -1 if self.drive_mode else 1, 'scale': scale, 'offset': _short(zero)}
        return {key: value for key, value in said.items() if value != _PLAIN[key]}


class Calibration(dict[str, Motor]):
    file: Path

    def of(self, joint: str) -> Motor | None:
        """Return the motor of a joint; a column may have a word before its name."""
        return next((m for name, m in self.items() if f'_{joint}'.endswith(f'_{name}')), None)


def calibration_beside(folder: Path, joints: Iterable[str]) -> Calibration | None:
    """The calibration of these joints in or next to a data set; refuse several that differ."""
    wanted = list(joints)
    places = (folder, folder / 'meta', folder.resolve().parent)
    patterns = ('*.json', 'calibration/**/*.json')
    files = {file for place in places for each in patterns for file in place.glob(each)}
    read = filter(None, map(_read, sorted(files)))
    found = [each for each in read if wanted and all(map(each.of, wanted))]
    if any(each != found[0] for each in found):
        raise UserError(
            f'{folder}: {found[0].file} and {found[-1].file} are calibrations of '
            'these joints and differ; leave the one that was recorded with'
        )
    return found[0] if found else None


def _read(file: Path) -> Calibration | None:
    try:
        content = json.loads(read_log_text(file))
        if not isinstance(content, Mapping) or not content:
            return None
        found = Calibration({name: Motor.model_validate(each) for name, each in content.items()})
    except (ValueError, RecursionError, UserError, ValidationError):
        return None
    found.file = file
    return found if all(m.range_min < m.range_max for m in found.values()) else None


def _short(value: float) -> float:
    return float(f'{value:.6g}')
