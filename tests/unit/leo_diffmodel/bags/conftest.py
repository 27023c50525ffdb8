# SPDX-License-Identifier: Apache-2.0
"""A recorder of the bag `bag` in the folder of the test, and what one that was killed leaves."""

import pytest

from leo_diffmodel.bags.recorder import Recorder
from leo_diffmodel.bags.types import STATES
from leo_diffmodel.bags.writer import BagWriter
from leo_msgs_py.cdr import joint_state


@pytest.fixture
def recorder(tmp_path):
    return Recorder(tmp_path / 'bag')


@pytest.fixture
def unfinished(tmp_path):
    """The file of a bag of ten states that a killed recorder leaves."""
    writer = BagWriter(tmp_path / 'running')
    channel = writer.add_topic(STATES.name, STATES.type)
    for stamp in range(0, 10**8, 10**7):
        writer.write(channel, joint_state(stamp, ['pivot'], [0.0], [0.0]), stamp)
    writer.flush()
    yield writer.file.read_bytes()
    writer.close()
