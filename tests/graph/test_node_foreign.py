# SPDX-License-Identifier: Apache-2.0
"""A peer that knows nothing of us: plain cyclonedds with hand-written types, on any interface."""

from pathlib import Path
import subprocess

import pytest

pytestmark = pytest.mark.graph
PEER = str(Path(__file__).with_name('peer.py'))
FOREIGN = str(Path(__file__).with_name('foreign.py'))
PATIENCE = 300.0


@pytest.mark.parametrize('interface', ['loopback', 'default'])
def test_data_flows_both_ways(spawn, domain, interface):
    peer = spawn(PEER, stderr=subprocess.PIPE)
    peer.stderr.readline()
    foreign = spawn(FOREIGN, str(domain), interface, stdout=subprocess.PIPE)
    output, _ = foreign.communicate(timeout=PATIENCE)
    assert output.split() == ['pivot', '0.5', '1.0', '-2.5']
