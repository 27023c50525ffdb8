# SPDX-License-Identifier: Apache-2.0
"""Names, QoS, user data and discovery settings on the wire."""

from cyclonedds.core import Policy
import pytest

from leo_msgs_py import topics
from leo_msgs_py.errors import UserError
from leo_msgs_py.qos import best_effort, HistoryPolicy, latched, QoSProfile, reliable
from leo_msgs_py.wire import config, names, qos


@pytest.mark.parametrize(
    'name, namespace, full',
    [
        ('joint_states', '/', '/joint_states'),
        ('joint_states', '/left', '/left/joint_states'),
        ('/clock', '/left', '/clock'),
        ('~/x', '/left', '/left/robot/x'),
        ('~', '/', '/robot'),
    ],
)
def test_names_expand_as_in_ros(name, namespace, full):
    assert names.expand(name, namespace, 'robot') == full


@pytest.mark.parametrize('name', ['1abc', 'a//b', 'a-b', 'x/', '', 'ä'])
def test_bad_names_are_refused(name):
    with pytest.raises(UserError, match='ROS name'):
        names.expand(name, '/', 'robot')


def test_dds_names_and_back():
    assert names.topic_to_dds('/a/b') == 'rt/a/b'
    assert names.topic_from_dds('rt/a/b') == '/a/b'
    assert names.topic_from_dds('ros_discovery_info') is None
    assert names.request_topic('/a/s') == 'rq/a/sRequest'
    assert names.reply_topic('/a/s') == 'rr/a/sReply'
    assert names.service_from_dds('rq/a/sRequest') == '/a/s'
    assert names.service_from_dds('rr/a/sReply') == '/a/s'
    assert names.service_from_dds('rt/a/sReply') is None
    assert names.type_to_dds('std_srvs/srv/SetBool_Request') == (
        'std_srvs::srv::dds_::SetBool_Request_'
    )
    assert names.type_from_dds('std_msgs::msg::dds_::Bool_') == 'std_msgs/msg/Bool'
    assert names.service_type_from_dds('std_srvs::srv::dds_::SetBool_Response_') == (
        'std_srvs/srv/SetBool'
    )


def test_qos_as_rmw_cyclonedds_maps_it():
    policies = qos.endpoint_qos(latched(5), 'std_msgs/msg/Bool')
    assert policies[Policy.Durability] == Policy.Durability.TransientLocal
    assert policies[Policy.DurabilityService].history == Policy.History.KeepLast(5)
    assert policies[Policy.DurabilityService].max_samples == -1
    assert policies[Policy.WriterDataLifecycle].autodispose is False
    assert policies[Policy.DataRepresentation].use_xcdrv2_representation is False
    user_data = policies[Policy.Userdata].data.decode()
    assert user_data.startswith('typehash=RIHS01_')
    assert user_data.endswith(';')


@pytest.mark.parametrize(
    'profile',
    [reliable(7), best_effort(1), latched(1), QoSProfile(0, history=HistoryPolicy.KEEP_ALL)],
)
def test_profiles_survive_the_way_to_dds_and_back(profile):
    policies = qos.endpoint_qos(profile, 'std_msgs/msg/Bool')
    if policies[Policy.Durability] is None:
        policies = policies + type(policies)(Policy.Durability.Volatile)
    assert qos.as_profile(policies) == profile


def test_every_topic_of_the_graph_has_a_valid_name():
    found = [t for t in vars(topics).values() if isinstance(t, (topics.Topic, topics.Service))]
    assert len(found) == 17
    assert all(names.is_valid(names.expand(t.name, '/', 'robot')) for t in found)
    assert [t.name for t in found if t.name.startswith('/')] == ['/clock', '/diagnostics']


def test_discovery_settings(monkeypatch):
    monkeypatch.delenv('ROS_DOMAIN_ID', raising=False)
    monkeypatch.delenv('ROS_AUTOMATIC_DISCOVERY_RANGE', raising=False)
    monkeypatch.delenv('CYCLONEDDS_URI', raising=False)
    assert (config.domain_id(), config.discovery_range()) == (0, 'LOCALHOST')
    local = config.cyclone_config('LOCALHOST', ['10.0.0.2'])
    assert '<AllowMulticast>false</AllowMulticast>' in local
    assert '<Peer address="localhost"/><Peer address="10.0.0.2"/>' in local
    assert '127.0.0.1' not in local  # peers elsewhere could not be reached from loopback
    assert '<NetworkInterface address="127.0.0.1"/>' in config.cyclone_config('LOCALHOST', [])
    assert 'AllowMulticast' not in config.cyclone_config('SUBNET', [])
    assert 'ros_discovery_off' in config.cyclone_config('OFF', [])
    assert config.cyclone_config('SYSTEM_DEFAULT', []) == ''
    monkeypatch.setenv('CYCLONEDDS_URI', 'file:///x.xml')
    assert config.cyclone_config('SUBNET', []).endswith(',file:///x.xml')


@pytest.mark.parametrize(
    'variable, value',
    [
        ('ROS_DOMAIN_ID', '233'),
        ('ROS_DOMAIN_ID', 'x'),
        ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCAL'),
    ],
)
def test_wrong_environment_is_one_clear_line(monkeypatch, variable, value):
    monkeypatch.setenv(variable, value)
    with pytest.raises(UserError, match=f'{variable}.*{value}'):
        config.describe()
