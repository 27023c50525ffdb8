# SPDX-License-Identifier: Apache-2.0
"""What a run would hit is known before it is sent."""

import numpy as np
import pytest

from leo_diffmodel.next_run.dry_run import dry_run
from leo_diffmodel.next_run.run_file import Run
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.model import Model
from leo_sim.model.state import State

SO101 = Model('so101', engine='rigid')
LIFT, GRIPPER = 1, 5


def goals(joint: int, goal: float, seconds: float = 1.0) -> Run:
    inputs = np.zeros((round((0.5 + seconds) / 0.02), 6))
    inputs[25:, joint] = goal
    return Run('r', '', inputs, np.ones(len(inputs), bool))


def test_a_stop_is_named_with_its_time_and_a_run_within_the_stops_hits_nothing():
    found = dry_run(goals(GRIPPER, -0.1745), SO101)
    assert len(found.hits) == 1 and found.hits[0].startswith('gripper runs into its stop at 0.')
    assert found.travels[GRIPPER].stops == pytest.approx((-0.174533, 1.74533))
    assert found.first == 0.0 and found.seconds == pytest.approx(1.5)
    calm = dry_run(goals(GRIPPER, 0.5), SO101)
    assert calm.hits == () and 0.4 < calm.travels[GRIPPER].high < 0.7
    assert calm.travels[GRIPPER].inputs == (0.0, 0.5) and calm.travels[GRIPPER].fastest > 0.5


def test_servos_first_go_from_where_they_are_and_what_lies_at_its_stop_hits_nothing():
    q = np.zeros(6)
    q[LIFT] = 1.7445  # at its stop, as a sensor with noise reads it
    found = dry_run(goals(GRIPPER, 0.3), SO101, State(q, np.zeros(6)))
    assert found.hits == () and found.first > 3.0
    assert found.travels[LIFT].high == pytest.approx(1.745, abs=0.01)
    q[LIFT] = 3.0
    with pytest.raises(UserError, match='shoulder_lift is at 3 rad, outside its stops'):
        dry_run(goals(GRIPPER, 0.3), SO101, State(q, np.zeros(6)))


def test_a_walker_falls_and_one_that_hangs_touches_nothing():
    leo = Model(load_robot('leo'), engine='rigid', scheme='search')
    run = Run('r', '', np.full((30, 6), 2.0), np.ones(30, bool))
    assert any('touches the ground' in hit for hit in dry_run(run, leo).hits)
    hung = Run('r', '', run.inputs, run.enabled, 'hanging')
    assert dry_run(hung, leo).hits == (), 'its own stops are part of its days'
