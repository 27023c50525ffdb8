# SPDX-License-Identifier: Apache-2.0
"""What the robot node says about itself: the worst news first, and every count."""

from collections import Counter
from contextlib import suppress
from types import SimpleNamespace

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus
import pytest

from leo_sim.drivers.safety import BadCommand, Faults, Safety
from leo_sim.nodes.commander import Ages
from leo_sim.nodes.diagnostics import robot_diagnostics
from leo_sim.nodes.loop import Health

STAMP = Time(sec=1, nanosec=500_000_000)


def diagnostics(safety=None, health=None, torque=True, missed=0, neighbours=()):
    health = health or Health(0.01)
    for _ in range(missed):
        health.note(0.0, 1.0)
    measured = SimpleNamespace(alarm=str, figures=dict)
    commander = SimpleNamespace(ages=Ages(0.0), count=1)
    gate, safety = SimpleNamespace(halts=0), safety or Safety([1.0])
    counts = {'health': health, 'faults': Faults(5), 'told': Counter()}
    loop = SimpleNamespace(safety=safety, measured=measured, gate=gate, **counts)
    return robot_diagnostics('/robot', STAMP, loop, torque, commander, neighbours)


def status(**given):
    return diagnostics(**given).status[0]


def stopped():
    safety = Safety([1.0])
    safety.e_stop()
    return safety


def late():
    safety = Safety([1.0], timeout=0.1)
    safety.accept([1.0], 0.0)
    safety.output(1.0)
    return safety


def garbled():
    safety = late()
    with suppress(BadCommand):
        safety.accept([1e308], 0.0)
    return safety


@pytest.mark.parametrize(
    ('given', 'level', 'said'),
    [
        ({}, DiagnosticStatus.OK, 'running'),
        ({'torque': False}, DiagnosticStatus.OK, 'motors free'),
        ({'missed': 3}, DiagnosticStatus.WARN, '3 deadlines missed'),
        ({'neighbours': ['/other']}, DiagnosticStatus.WARN, 'same commands: /other'),
        ({'safety': late(), 'missed': 3}, DiagnosticStatus.WARN, 'timed out'),
        ({'safety': garbled()}, DiagnosticStatus.WARN, '1 commands ignored'),
        ({'safety': stopped(), 'missed': 3}, DiagnosticStatus.ERROR, 'e-stop'),
    ],
)
def test_the_worst_news_sets_the_level(given, level, said):
    found = status(**given)
    assert found.level == level and said in found.message


def test_counts_and_loop_times_are_reported():
    health = Health(period=0.01)
    for loop_time, lateness in ((0.001, 0.0), (0.003, 0.005), (0.002, 0.02)):
        health.note(loop_time, lateness)
    values = {pair.key: pair.value for pair in status(safety=late(), health=health).values}
    assert values['states in the last second'] == '3'
    assert (values['loop time mean ms'], values['loop time max ms']) == ('2.000', '3.000')
    assert (values['missed deadlines'], values['command timeouts']) == ('1', '1')
    assert health.take_loop_times() == (0, 0.0, 0.0), 'the next second starts anew'


def test_lockstep_is_never_late():
    health = Health(period=0.0)
    health.note(0.001, 5.0)
    assert health.missed == 0


def test_the_message_is_stamped_and_names_its_node():
    message = diagnostics()
    assert message.header.stamp == STAMP and [s.name for s in message.status] == ['/robot']
