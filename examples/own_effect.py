# SPDX-License-Identifier: Apache-2.0
"""An effect of your own, tried beside the known ones: a hose that pulls back past an angle.

    python examples/own_effect.py bags/hose torque_pendulum

This file goes to the commands, too: leo explain … --effect examples/own_effect.py
"""

import sys

import numpy as np

from leo_diffmodel import explain
from leo_sim.effects import Effect, Parameter


class Hose(Effect):
    """A hose that pulls back past an angle: tau = -k (q - slack) for q > slack, else 0."""

    name = 'hose'
    family = 'position-dependent torque'
    hook = 'torque'
    parameters = (
        Parameter('k', 'N m/rad', low=0.0),
        Parameter('slack', 'rad', low=-3.0, high=3.0),
    )
    looks_like = 'A torque that grows with the angle, on one side only.'
    confused_with = 'joint_spring'
    reveal = 'Slow turns to both sides, far past the slack.'

    def torque(self, p, q, dq, motor, load):
        return -p['k'] * np.maximum(q - p['slack'], 0.0)


if __name__ == '__main__':
    if len(sys.argv) != 3:
        sys.exit('usage: python examples/own_effect.py BAG MODEL')
    bag, model = sys.argv[1:]
    answer = explain(bag, model, effects=[Hose()])
    print(f'{answer.verdict}: {answer.sentence}')
