# SPDX-License-Identifier: Apache-2.0
"""Takes one safety measure out at a time: at least one test must fail for each.

    python benchmarks/safety_mutations.py [NAME ...]

The change is made in a copy of the source, so the tests here run against it.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
from tempfile import TemporaryDirectory
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
SIM = Path('src/leo_sim/leo_sim')
SAFETY, SENDERS = SIM / 'drivers/safety.py', SIM / 'nodes/senders.py'
GATE = SIM / 'nodes/watchdog.py'
NODE, DRIVER = SIM / 'nodes/robot.py', SIM / 'drivers/dynamixel.py'
JOINTS, SHARED = SIM / 'drivers/servo_joints.py', SIM / 'drivers/servo_driver.py'
UNIT, GRAPH = 'tests/unit/', 'tests/graph/'
FAULTS, SERVOS = f'{GRAPH}test_robot_faults.py', f'{UNIT}test_driver_dynamixel.py'


class Mutation(NamedTuple):
    """A measure that is taken out: the text that is replaced, and the tests that should fail."""

    file: Path
    old: str
    new: str
    tests: str


MUTATIONS = {
    'time-out': Mutation(
        SAFETY, 'self._is_too_old(now)\n', 'False\n', f'{UNIT}test_safety.py'),
    'latch': Mutation(
        SAFETY, '        self.timed_out = False\n\n    def output',
        '        self.timed_out = self.e_stopped = False\n\n    def output',
        f'{UNIT}test_safety.py'),
    'clip': Mutation(
        SAFETY, 'np.clip(self._command, -self._limits, self._limits)', 'self._command',
        f'{UNIT}test_safety.py'),
    'limits above 0': Mutation(
        SAFETY, '(np.isfinite(values) & (values > 0.0)).all()', 'True', f'{UNIT}test_safety.py'),
    '0 while blind': Mutation(
        SAFETY, 'self.stops(now) or blind', 'self.stops(now)', f'{UNIT}test_safety.py'),
    'watchdog': Mutation(
        GATE, 'if not (self._driven', 'if True or not (self._driven', f'{FAULTS} -k hangs'),
    'e-stop and time-out beside the loop': Mutation(
        GATE, 'self._safety.stops(self._clock()) or ', '', f'{FAULTS} -k e_stop_acts'),
    'silence': Mutation(
        GATE, 'or (0.0 < self._silence < silent)', '', f'{FAULTS} -k hangs'),
    'stale commands': Mutation(
        SENDERS, 'if not self._limit or not sent_ns:', 'if True:', f'{UNIT}test_senders.py'),
    'stale commands in the node': Mutation(
        NODE, 'if not self._commander.is_new(info):', 'if False:', f'{FAULTS} -k waited'),
    'two commanders': Mutation(
        NODE, 'if self._commander.has_rival(info):', 'if False:', f'{FAULTS} -k turns'),
    'faults end it': Mutation(
        SIM / 'faults.py', 'if self.in_a_row > self._patience:', 'if False:',
        f'{UNIT}test_faults.py'),
    'clip of the servos': Mutation(
        JOINTS, 'np.clip(counts, -self.largest(supply), self.largest(supply))', 'counts', SERVOS),
    '0 stays 0': Mutation(
        JOINTS, 'np.minimum(low, 0.0), np.maximum(high, 0.0)', 'low, high', SERVOS),
    'joint limits': Mutation(
        JOINTS, 'np.where(outward, 0.0, values)', 'values', SERVOS),
    "servos' watchdog": Mutation(
        DRIVER, "            self._bus.set(servo, 'bus_watchdog', min(max(waits, 1), "
        'WATCHDOG_MOST))\n', '            pass\n', f'{SERVOS} -k by_themselves'),
    'goal 0 before torque': Mutation(
        DRIVER, '        self._bus.set(servo, self._motors.goal, 0)\n', '', SERVOS),
    'lost writes': Mutation(
        SHARED, '        self._check_taken(blocks)\n', '', SERVOS),
    'late answers': Mutation(
        SHARED, '        self._check_fresh(sent, blocks)\n', '', SERVOS),
    'nobody watches a killed process': Mutation(
        SIM / 'drivers/feetech.py',
        '        self._guardian = Guardian(self._bus.descriptor, self._zeros)\n', '',
        f'{UNIT}test_driver_feetech.py -k killed'),
    'answers to other questions': Mutation(
        SIM / 'drivers/servo_line.py', 'and self._packets.size != size', 'and False',
        f'{SERVOS} -k another_question'),
    "faults of a user's code": Mutation(
        SIM / 'user_code.py', 'raise raises(', 'raise error  # (', f'{UNIT}test_driver_files.py'),
    'alerts': Mutation(
        SHARED, '        self._check_alerts(blocks)\n', '', SERVOS),
}


def main() -> int:
    """Run and print; 1 if a measure can be taken out unnoticed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('names', nargs='*', help=', '.join(MUTATIONS))
    names = parser.parse_args().names or list(MUTATIONS)
    missed = [name for name in names if not noticed(name, MUTATIONS[name])]
    print(f'{len(names) - len(missed)} of {len(names)} are noticed')
    return int(bool(missed))


def noticed(name: str, mutation: Mutation) -> bool:
    """Whether a test fails without a measure."""
    with TemporaryDirectory() as folder:
        source = Path(folder) / 'src'
        shutil.copytree(ROOT / 'src', source, ignore=shutil.ignore_patterns('*.pyc'))
        file = Path(folder) / mutation.file
        text = file.read_text()
        assert text.count(mutation.old) == 1, f'{name}: {mutation.file} has changed'
        file.write_text(text.replace(mutation.old, mutation.new))
        paths = os.pathsep.join(str(package) for package in sorted(source.iterdir()))
        run = subprocess.run(
            [sys.executable, '-m', 'pytest', '-q', '-x', '-p', 'no:cacheprovider',
             *mutation.tests.split()],
            cwd=ROOT, env={**os.environ, 'PYTHONPATH': paths}, capture_output=True, text=True)
    failed = re.findall(r'^(?:FAILED|ERROR) \S+::(\S+)', run.stdout, re.MULTILINE)
    print(f'{name:37}{failed[0] if failed else "NOT NOTICED"}', flush=True)
    return bool(failed)


if __name__ == '__main__':
    sys.exit(main())
