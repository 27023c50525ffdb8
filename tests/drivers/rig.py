# SPDX-License-Identifier: Apache-2.0
"""A rig that stands still and does what a test writes into a file; it writes down all calls.

The file `orders` in the working directory holds one of: `lose N` (the next N reads lose
their packet), `hold` (the next read waits for the file
`released`), `break` (the cable is out), `bug M` (the
method M fails with a ValueError from now on), `rubbish` (read returns something else).
"""

from pathlib import Path

import numpy as np

from leo_msgs_py.values import Applied, JointStates
from leo_sim.drivers.base import NotPossible, robot_info, TransientFault

ORDERS, CALLS, RELEASED = Path('orders'), Path('calls'), Path('released')


class Rig:
    def __init__(self, options):
        self.info = robot_info(options.robot, options.state_rate, own_clock=False)
        self.starts = 0
        self._computer = options.computer
        self._lose = 0
        self._bug = ''

    def connect(self):
        self._note('connect')

    def read(self):
        self._obey()
        if self._lose:
            self._lose -= 1
            raise TransientFault('no answer from servo 1')
        self._may_fail('read')
        if self._bug == 'rubbish':
            return [0.0]
        zeros = np.zeros(len(self.info.joints))
        return JointStates(self._computer.time_ns(), self.info.joints, zeros, zeros)

    def write(self, values):
        self._may_fail('write')
        self._note('write', values)
        return Applied(self._computer.time_ns(), self.info.actuators, values, self.info.interface)

    def halt(self):
        self._may_fail('halt')
        values = np.zeros(len(self.info.actuators))
        self._note('halt', values)
        return Applied(self._computer.time_ns(), self.info.actuators, values, self.info.interface)

    def advance(self, seconds):
        return seconds

    def set_torque(self, on):
        self._note(f'torque {on}')

    def reset(self):
        raise NotPossible('put it there by hand')

    def stop(self):
        self._may_fail('stop')
        self._note('stop')

    def _may_fail(self, method):
        if self._bug == method:
            raise ValueError(f'{method}\nis wrong')

    def _obey(self):
        if not ORDERS.exists():
            return
        word, _, number = ORDERS.read_text().strip().partition(' ')
        ORDERS.unlink()
        self._note(f'begin {word}')
        if word == 'lose':
            self._lose = int(number)
        elif word == 'hold':
            while not RELEASED.exists():
                self._computer.sleep(0.01)
            RELEASED.unlink()
        elif word == 'bug':
            self._bug = number
        elif word == 'rubbish':
            self._bug = word
        elif word == 'break':
            raise OSError(5, 'Input/output error')
        self._note(f'end {word}')

    def _note(self, what, values=()):
        with CALLS.open('a') as file:
            file.write(f'{self._computer.monotonic():.6f} {what} {" ".join(map(str, values))}\n')
