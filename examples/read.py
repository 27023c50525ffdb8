# SPDX-License-Identifier: Apache-2.0
"""What a bag holds, as arrays.

python examples/read.py bags/friction torque_pendulum
"""

import sys

import numpy as np

from leo_diffmodel import read_bag

if len(sys.argv) != 3:
    sys.exit('usage: python examples/read.py BAG ROBOT')
bag, robot = sys.argv[1:]
recording = read_bag(bag, robot)
for warning in recording.warnings:
    print('warning:', warning)
print(f'{len(recording.episodes)} episode(s), one command every {recording.command_period:g} s')
for episode in recording.episodes:
    rate = 1 / np.median(np.diff(episode.t))
    print(f'{episode.t[-1] - episode.t[0]:.1f} s, {rate:.0f} states a second')
    for i, joint in enumerate(recording.joints):
        q, dq = episode.q[:, i], episode.dq[:, i]
        print(f'  {joint}: {q.min():.2f} to {q.max():.2f} rad, at most {abs(dq).max():.1f} rad/s')
    for i, joint in enumerate(recording.actuators):
        rms = np.sqrt((episode.inputs[:, i] ** 2).mean())
        print(f'  {joint}: {recording.input} rms {rms:.2f}')
