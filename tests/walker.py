# SPDX-License-Identifier: Apache-2.0
"""Recordings of LEO doing scripted motions, in memory, with noise."""

from dataclasses import replace

import numpy as np
from tests.simulate import of_robot

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.next_run.menu import MotionRun
from leo_diffmodel.next_run.simulate import performed
from leo_sim.description.robot import load_robot
from leo_sim.effects import Placed
from leo_sim.model import Model
from leo_sim.task.motions import MOTIONS

LEO = load_robot('leo')
NOISE = (1e-3, 0.05)
SIGMA = np.repeat(NOISE, 9)


def did(motion: str, *effects: Placed, seconds: float = 3.0, seed: int = 1) -> Recording:
    """A motion of LEO with effects, 100 Hz, measured with `NOISE`."""
    model = Model(LEO, effects, engine='rigid', scheme='training')
    rng = np.random.default_rng([seed, 1])
    episodes = tuple(
        replace(
            e,
            q=e.q + rng.normal(0, NOISE[0], e.q.shape),
            dq=e.dq + rng.normal(0, NOISE[1], e.dq.shape),
        )
        for e in performed(MotionRun(motion, seed, seconds), model, 0.01)
    )
    held = str(LEO.start_poses[MOTIONS[motion].start].held).lower()
    known = {'period': 0.03, 'metadata': {'held': held}}
    return of_robot(LEO, *episodes, name=motion, **known)
