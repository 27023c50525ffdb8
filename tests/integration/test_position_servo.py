# SPDX-License-Identifier: Apache-2.0
"""A position servo that hides a dead zone: recorded through its driver, read, and explained."""

from pathlib import Path

import numpy as np
import pytest
from tests.searched import searched
from tests.simulate import DT, NOISE, POSITION, rounded, steps
import yaml

from leo_diffmodel.bags.recording import read_bag, Recording
from leo_diffmodel.bags.types import APPLIED, STATES
from leo_diffmodel.bags.writer import BagWriter
from leo_msgs_py.cdr import joint_state
from leo_sim.drivers.base import DriverOptions
from leo_sim.drivers.simulated import SimulatedDriver
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.model_file import write_effects

DEAD_ZONE, SECONDS = 0.6, 6.0


def recorded(folder: Path, topic: str = 'position') -> Recording:
    """Random goals, the first after a while without any, on a robot with a dead zone."""
    hidden = folder / 'hidden.yaml'
    zone = place(POSITION, 'voltage_deadband', 'pivot', v=DEAD_ZONE)
    hidden.write_text(yaml.safe_dump({'effects': write_effects([zone])}))
    driver = SimulatedDriver(
        DriverOptions(POSITION, noise=NOISE, engine='rk4', private={'hidden': str(hidden)})
    )
    bag = BagWriter(folder / 'bag')
    states, applied = (bag.add_topic(*t) for t in (STATES, APPLIED[topic]))
    for goal in np.concatenate([np.full((20, 1), np.nan), steps(POSITION, SECONDS, 3)]):
        seen, sent = driver.read(), driver.write(goal)
        now = seen.stamp_ns
        bag.write(states, joint_state(now, seen.names, seen.position, seen.velocity), now)
        bag.write(applied, joint_state(now, sent.names, position=sent.nan_where_free), now)
        driver.advance(DT)
    bag.close()
    return read_bag(folder / 'bag', POSITION)


def test_it_is_named_from_the_bag(tmp_path: Path) -> None:
    recording = recorded(tmp_path)
    (episode,) = recording.episodes
    assert recording.input == 'position'
    assert episode.enabled[:, 0].sum() == SECONDS / DT, 'free before the first goal'
    for data in (recording, rounded(recording)):
        found = searched([data], Model(POSITION))
        (top,) = found.chosen.names
        assert top.effect.name == 'voltage_deadband'
        assert found.final.theta[0] == pytest.approx(DEAD_ZONE, abs=0.01)
