# SPDX-License-Identifier: Apache-2.0
"""Recording on and off."""

import pytest

from leo_diffmodel.watch.live.commands import NOWHERE, RecordingSwitch
from leo_msgs_py.errors import UserError


def test_without_a_folder_nothing_can_be_recorded():
    switch = RecordingSwitch(None)
    assert not switch.possible and switch.words == NOWHERE
    with pytest.raises(UserError, match='-o DIR'):
        switch.start()
    switch.wait()


def test_before_the_first_recording_there_is_no_folder(tmp_path):
    switch = RecordingSwitch(tmp_path / 'out')
    assert switch.possible and not switch.on and not switch.size
    assert switch.words == 'nothing is recorded' and not (tmp_path / 'out').exists()
