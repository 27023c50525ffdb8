# SPDX-License-Identifier: Apache-2.0
"""What our nodes announce, against what a real ROS 2 node was seen to announce."""

import json
from pathlib import Path
import re
import time

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsParticipant,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import Policy
import pytest

from leo_msgs_py.wire import qos
from leo_msgs_py.wire.graph import Graph
from leo_msgs_py.wire.participant import Participant

pytestmark = pytest.mark.graph
PEER = str(Path(__file__).with_name('peer.py'))
SAMPLE = Path(__file__).parents[3] / 'shared' / 'wire_samples' / 'discovery.json'
PATIENCE = 120.0
IDENTITY = re.compile(r'(client|service)id= 1\.10(\.[0-9a-f]{1,2}){14};')


@pytest.fixture
def observer(domain):
    participant = Participant.from_environment()
    yield participant, Graph(participant)
    participant.close()


def wait_for(condition):
    deadline = time.monotonic() + PATIENCE
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert condition()


def expected() -> dict[tuple[str, str], dict]:
    """Endpoints of the real node, but for type description and what it declares alone."""
    skipped = ('get_type_description',)
    return {
        (e['kind'], e['topic']): e
        for e in json.loads(SAMPLE.read_text())['endpoints']
        if not any(word in e['topic'] for word in skipped)
    }


def announced(participant, gid) -> dict[tuple[str, str], object]:
    kinds = {
        'writer': BuiltinTopicDcpsPublication,
        'reader': BuiltinTopicDcpsSubscription,
    }
    return {
        (kind, sample.topic_name): sample
        for kind, topic in kinds.items()
        for sample in BuiltinDataReader(participant.entity, topic).read(10_000)
        if sample.participant_key.bytes == gid
    }


@pytest.mark.skipif(not SAMPLE.exists(), reason=f'no {SAMPLE}')
def test_endpoints_are_those_of_a_real_node(observer, spawn):
    participant, graph = observer
    spawn(PEER, '--ros-args', '-r', '__ns:=/probe')
    wanted = expected()
    wait_for(lambda: any(n.full_name == '/probe/talker' and n.writers for n in graph.nodes()))
    (node,) = [n for n in graph.nodes() if n.full_name == '/probe/talker']
    gid = node.writers[0][:12] + bytes.fromhex('000001c1')
    wait_for(lambda: wanted.keys() <= announced(participant, gid).keys())
    ours = announced(participant, gid)
    for key, real in wanted.items():
        check_endpoint(ours[key], real)
    gids = {s.key.bytes for (_, topic), s in ours.items() if topic != 'ros_discovery_info'}
    wait_for(lambda: gids == {g for n in graph.nodes() for g in (*n.readers, *n.writers)})
    (peer,) = [
        sample
        for sample in BuiltinDataReader(participant.entity, BuiltinTopicDcpsParticipant).read(99)
        if sample.key.bytes == gid
    ]
    assert peer.qos[Policy.Userdata].data == b'enclave=/;'


def check_endpoint(ours, real) -> None:
    """Type, user data and QoS of one endpoint, ids aside."""
    assert ours.type_name == real['type']
    user_data = ours.qos[Policy.Userdata].data.decode()
    assert IDENTITY.sub(r'\1id=;', user_data) == IDENTITY.sub(r'\1id=;', real['user_data'])
    policies = real['qos']
    assert ours.qos[Policy.Durability] == getattr(Policy.Durability, policies['durability'])
    reliable = isinstance(ours.qos[Policy.Reliability], Policy.Reliability.Reliable)
    assert reliable == (policies['reliability']['kind'] == 'RELIABLE')
    assert ours.qos[Policy.DataRepresentation].use_xcdrv2_representation is False
    if real['kind'] == 'writer':
        check_writer(ours.qos, policies)


def check_writer(ours, policies) -> None:
    """What only writers announce."""
    service = ours[Policy.DurabilityService]
    assert service.history == Policy.History.KeepLast(
        policies['durability_service']['history']['depth']
    )
    lifespan = ours[Policy.Lifespan].lifespan
    real = policies['lifespan_ns']
    assert lifespan == (2**63 - 1 if real == 'infinite' else real)
    assert ours[Policy.WriterDataLifecycle].autodispose is False


def test_a_node_leaves_at_once(observer, spawn):
    _, graph = observer
    peer = spawn(PEER)
    wait_for(lambda: [n.name for n in graph.nodes()] == ['talker'])
    peer.terminate()
    assert peer.wait(PATIENCE) == 0
    gone = time.monotonic()
    wait_for(lambda: graph.nodes() == [])
    assert time.monotonic() - gone < 5.0  # a lease runs out only after 10 s


def test_identities_are_those_of_rmw_cyclonedds(observer):
    participant, _ = observer
    first = participant.service_identity('clientid')
    second = participant.service_identity('serviceid')
    assert IDENTITY.fullmatch(first)
    assert IDENTITY.fullmatch(second)
    assert first.split('=')[1] != second.split('=')[1]
    assert qos.participant_qos()[Policy.Userdata].data == b'enclave=/;'
