# SPDX-License-Identifier: Apache-2.0
"""A recorder of the bag `bag` in the folder of the test."""

import pytest

from leo_diffmodel.bags.recorder import Recorder


@pytest.fixture
def recorder(tmp_path):
    return Recorder(tmp_path / 'bag')
