# SPDX-License-Identifier: Apache-2.0
"""The emulated bus against the packet handler of ROBOTIS' own SDK."""

from importlib.resources import files
import os

import dynamixel_sdk as sdk
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from tests.drivers.bus import running
from tests.drivers.clock import Clock

from leo_sim.description.robot import load_robot
from leo_sim.description.servos import CURRENT_MODE, PWM_MODE, registers, servo_model, servo_models
from leo_sim.drivers.base import DriverOptions, TransientFault
from leo_sim.drivers.listening import answering_time, GONE
from leo_sim.drivers.servo_bus import dynamixel, feetech
from leo_sim.drivers.servo_bus.line import BROADCAST, Line, Packet, Reader, Trouble
from leo_sim.drivers.servo_bus.plant import Plant, SLICE
from leo_sim.drivers.servo_bus.rig import Terminal
from leo_sim.drivers.servo_bus.servo import ACCESS, ALERT, LIMIT, RANGE, Servo
from leo_sim.drivers.servo_line import CONFIGURE
from leo_sim.drivers.servo_port import BITS, Limits

SDK = sdk.Protocol2PacketHandler()
R = registers()
LEGS = (1, 2, 3, 4, 5, 6)


@pytest.fixture
def rig():
    return running(load_robot('leo'), 13.8, 'hanging')


class Port(Limits, sdk.PortHandler):
    def __init__(self, rig):
        super().__init__(rig.port)
        self.computer, self.slack = rig.computer, CONFIGURE
        self.setBaudRate(1_000_000)


@pytest.fixture
def port(rig):
    return Port(rig)


def write(port, servo, name, value):
    at, size, data = R[name].address, R[name].size, list(R[name].encode(value))
    result, error = SDK.writeTxRx(port, servo, at, size, data)
    assert result == sdk.COMM_SUCCESS
    return error


def read(port, servo, name):
    register = R[name]
    data, result, _ = SDK.readTxRx(port, servo, register.address, register.size)
    assert result == sdk.COMM_SUCCESS
    return register.decode(bytes(data))


def in_pwm_mode(port, servo):
    assert write(port, servo, 'operating_mode', PWM_MODE) == 0
    assert write(port, servo, 'goal_pwm', 0) == 0
    assert write(port, servo, 'torque_enable', 1) == 0


@given(st.lists(st.sampled_from([0xFF, 0xFD, 0x00, 0x55]), max_size=40))
def test_the_sdk_stuffs_the_same_way(values):
    body = bytes(values)
    assert dynamixel.unstuffed(dynamixel.stuffed(body)) == body
    packet = [0xFF, 0xFF, 0xFD, 0, 3, len(body) + 3, 0, 0x02, *body, 0, 0]
    assert bytes(SDK.addStuffing(packet)[7:-2]) == dynamixel.stuffed(b'\x02' + body)


def feetech_encoded(packet):
    return feetech.encoded(packet.id, packet.instruction, packet.parameters)


@pytest.mark.parametrize(
    ('framing', 'encode', 'rubbish'),
    [
        (dynamixel.FRAMING, dynamixel.encoded, b'\xff\x00\xff'),
        (feetech.FRAMING, feetech_encoded, b'\x01\xff\x02'),
    ],
)
@given(
    st.lists(st.builds(Packet, st.integers(0, 252), st.integers(0, 254), st.binary(max_size=20))),
    st.integers(1, 7),
)
def test_packets_are_found_in_pieces_and_between_rubbish(framing, encode, rubbish, sent, size):
    stream = b''.join(rubbish + encode(packet) for packet in sent)
    reader, found = Reader(framing), []
    for start in range(0, len(stream), size):
        found += reader.feed(stream[start : start + size])
    assert found == sent


def test_the_registers_are_those_of_robotis_model_files():
    folder = files('dynamixel_easy_sdk') / 'control_table'
    lines = (folder / 'dynamixel.model').read_text().splitlines()
    numbers = dict(line.split('\t')[:2][::-1] for line in lines)
    for model in (m for m in servo_models().values() if m.family == 'dynamixel'):
        file = model.name.lower().replace('-', '_')
        assert int(numbers[f'{file}.model']) == model.number
        rows = (folder / f'{file}.model').read_text().split('[control table]')[1].splitlines()[2:]
        theirs = {
            name.strip().lower().replace(' ', '_'): (int(address), int(size))
            for address, size, name in (row.split('\t')[:3] for row in rows if row.strip())
        }
        ours = {name: (r.address, r.size) for name, r in model.registers.items()}
        assert ours.items() <= theirs.items() and not model.lacks & theirs.keys()


def test_ping(port):
    assert SDK.ping(port, 1) == (1030, sdk.COMM_SUCCESS, 0)
    assert SDK.ping(port, 77)[1] == sdk.COMM_RX_TIMEOUT


def test_eeprom_is_locked_while_torque_is_on_and_limits_hold(port):
    assert read(port, 1, 'goal_pwm') == 885, 'whoever forgets the goal finds it at the whole PWM'
    in_pwm_mode(port, 1)
    assert write(port, 1, 'operating_mode', CURRENT_MODE) == ACCESS
    assert write(port, 1, 'present_position', 0) == ACCESS, 'read only'
    assert write(port, 1, 'goal_pwm', 886) == LIMIT
    assert write(port, 1, 'torque_enable', 2) == RANGE
    assert write(port, 1, 'torque_enable', 0) == 0
    assert write(port, 1, 'pwm_limit', 300) == 0
    assert write(port, 1, 'goal_pwm', 301) == LIMIT
    assert write(port, 1, 'goal_pwm', -300) == 0
    assert read(port, 1, 'goal_pwm') == -300


def test_the_bus_watchdog_stops_and_keeps_goals_from_being_written(rig, port):
    in_pwm_mode(port, 1)
    assert write(port, 1, 'bus_watchdog', 5) == 0
    write(port, 1, 'goal_pwm', 200)
    rig.until(lambda: rig.plant.servos['left_hip'].get('bus_watchdog') != 5)
    assert read(port, 1, 'bus_watchdog') == -1
    assert (read(port, 1, 'goal_pwm'), read(port, 1, 'torque_enable')) == (0, 1)
    assert write(port, 1, 'goal_pwm', 10) == RANGE
    assert write(port, 1, 'bus_watchdog', 0) == 0
    assert write(port, 1, 'goal_pwm', 10) == 0


def write_goal(servo, count):
    register = registers(servo.model.family)['goal_position']
    return servo.write(register.address, register.encode(count))


def test_goal_positions_are_of_one_turn_or_of_many_and_a_watchdog_stops_where_it_is():
    servo = Servo(1, servo_model('XL330-M288'))
    servo.set('operating_mode', 3)
    servo.set('max_position_limit', 3000)
    assert [write_goal(servo, n) for n in (3001, -1, 3000)] == [LIMIT, LIMIT, 0]
    servo.set('operating_mode', 4)
    assert write_goal(servo, -20000) == 0 and servo.goal == -20000
    assert write_goal(servo, 2_000_000) == LIMIT
    for name, value in (('bus_watchdog', 5), ('torque_enable', 1), ('present_position', -512)):
        servo.set(name, value)
    servo.hear(1.0)
    servo.watch(1.05)
    assert servo.goal == -20000
    servo.watch(1.2)
    assert (servo.goal, servo.get('torque_enable'), servo.get('bus_watchdog')) == (-512, 1, -1)
    assert write_goal(servo, 0) == RANGE
    servo.set('operating_mode', PWM_MODE)
    assert servo.goal is None


def test_a_feetech_servo_goes_to_its_limits_and_no_further():
    servo = feetech.FeetechServo(1, servo_model('STS3215'))
    servo.set('max_position_limit', 3000)
    assert write_goal(servo, 3500) == 0 and servo.goal == 3000
    assert servo.get('goal_position') == 3500
    servo.set('operating_mode', 2)
    assert servo.goal is None


def test_an_overheated_servo_lets_go_and_says_so_until_it_is_restarted(rig, port):
    in_pwm_mode(port, 1)
    rig.order(lambda: rig.bus.servos[1].fail(0x04))
    assert read(port, 1, 'hardware_error_status') == 4
    assert SDK.ping(port, 1)[2] == ALERT
    assert read(port, 1, 'torque_enable') == 0
    assert write(port, 1, 'torque_enable', 1) & 0x7F == 1, 'refused'
    rig.order(lambda: rig.bus.servos[1].restart())
    assert read(port, 1, 'hardware_error_status') == 0
    assert read(port, 1, 'operating_mode') == PWM_MODE, 'the EEPROM is kept'
    assert write(port, 1, 'torque_enable', 1) == 0


def test_behind_a_silent_servo_all_are_silent(rig, port):
    rig.bus.silent = frozenset({2})
    reader = sdk.GroupSyncRead(port, SDK, 132, 4)
    for servo in (1, 2, 3):
        reader.addParam(servo)
    assert reader.txRxPacket() == sdk.COMM_RX_TIMEOUT
    assert SDK.ping(port, 3)[1] == sdk.COMM_SUCCESS


@pytest.mark.parametrize('trouble', ['lose', 'cut', 'wrong_crc', 'rubbish', 'late'])
def test_troubles_are_as_frequent_as_asked(trouble):
    line = Line(1e6, Trouble(**{trouble: 0.3}), seed=1)
    sent = dynamixel.encoded(dynamixel.status(1, 0, bytes(20)))
    bad = sum(line.carried(sent) != (sent, 0.0) for _ in range(2000))
    assert 500 < bad < 700


@pytest.mark.parametrize('trouble', ['lose', 'cut', 'wrong_crc', 'rubbish'])
def test_no_damaged_packet_is_taken_for_another(rig, port, trouble):
    setattr(rig._line.trouble, trouble, 0.3)
    good = 0
    for _ in range(30):
        port.clearPort()
        data, result, _ = SDK.readTxRx(port, 1, 144, 2)
        good += result == sdk.COMM_SUCCESS
        assert result != sdk.COMM_SUCCESS or data == [138, 0]
    assert good > 3


@pytest.fixture
def terminal():
    plant = Plant(DriverOptions(load_robot('leo'), start='hanging'), 13.8, 0.0)
    made = Terminal(plant, Line(9600.0, Trouble()), computer=Clock())
    theirs = os.open(made.port, os.O_RDWR)
    yield made, theirs
    os.close(theirs)
    made.unplug()


def ask(terminal, theirs, packet):
    before = terminal._last_bytes
    os.write(theirs, dynamixel.encoded(packet))
    while terminal._last_bytes == before:
        terminal.step()


def test_an_answer_is_late_by_the_time_for_which_the_servos_listened(terminal):
    terminal, theirs = terminal
    clock = terminal._computer
    late = answering_time(theirs, clock)
    began = late()
    clock.sleep(0.5 * GONE)
    assert late() == began, 'a bus that does not run has not been late'
    terminal.step()
    assert late() - began == pytest.approx(SLICE, abs=1e-6)
    terminal._line.trouble.late, terminal._line.trouble.late_by = 1.0, 0.3
    before, ours = late(), clock.monotonic()
    ask(terminal, theirs, Packet(1, dynamixel.PING))
    assert late() - before == pytest.approx(clock.monotonic() - ours, abs=SLICE + 1e-3)
    assert late() - before > 0.3
    dead = late()
    clock.sleep(GONE + 2.0)
    assert late() - dead == pytest.approx(2.0), 'a dead bus is waited for'


def test_a_whole_answer_is_taken_however_late_this_process_looks(rig, port):
    SDK.txPacket(port, [0xFF, 0xFF, 0xFD, 0, 1, 3, 0, dynamixel.PING, 0, 0])
    port.setPacketTimeout(14)
    rig.computer.sleep(1.0)
    assert SDK.rxPacket(port, False)[1] == sdk.COMM_SUCCESS


def test_rubbish_without_an_end_ends(rig, port, monkeypatch):
    port.setPacketTimeout(14)
    monkeypatch.setattr(port.ser, 'read', lambda size: rig.computer.sleep(0.01) or b'r' * size)
    with pytest.raises(TransientFault, match='no whole answer'):
        SDK.rxPacket(port, False)


def test_a_cable_out_of_the_computer_is_no_port(terminal):
    terminal, theirs = terminal
    ask(terminal, theirs, Packet(1, dynamixel.PING))
    terminal.order(terminal.unplug)
    terminal.step()
    assert terminal.port == ''
    with pytest.raises(OSError):
        os.write(theirs, b'1')
    terminal.step()
    terminal.order(terminal.plug)
    terminal.step()
    again = os.open(terminal.port, os.O_RDWR)
    ask(terminal, again, Packet(1, dynamixel.PING))
    assert os.read(again, 100)[:4] == dynamixel.HEADER
    os.close(again)


def test_servos_answer_one_after_another_as_their_bytes_take(terminal, monkeypatch):
    """At 9600 baud a status of 13 bytes takes 13.5 ms, and none is there before its bytes."""
    terminal, theirs = terminal
    written, clock = [], terminal._computer
    packet = Packet(
        BROADCAST, dynamixel.SYNC_READ, bytes([R['present_pwm'].address, 0, 2, 0, *LEGS])
    )
    os.write(theirs, dynamixel.encoded(packet))
    monkeypatch.setattr(os, 'write', lambda _, data: written.append((clock.monotonic(), data)))
    while not written:
        terminal.step()
    assert [data[4] for _, data in written] == [*LEGS]
    sent, answer = (len(dynamixel.encoded(packet)), 13)
    due = (sent + answer * np.arange(1, len(LEGS) + 1)) * BITS / 9600
    delays = 250 * 2e-6 * np.arange(1, len(LEGS) + 1)
    assert [at for at, _ in written] == pytest.approx(due + delays)


@pytest.mark.parametrize(('step', 'left'), [(3.0, 127), (0.04, -1)])
def test_a_process_that_was_stopped_does_not_let_the_watchdogs_expire(terminal, step, left):
    terminal, _ = terminal
    for name, value in (('torque_enable', 1), ('bus_watchdog', 127)):
        terminal.bus.servos[1].set(name, value)
    for _ in range(round(3.0 / step)):
        terminal._computer.sleep(step)
        terminal.step()
    assert terminal.bus.servos[1].get('bus_watchdog') == left


def test_a_hand_holds_the_robot_until_a_motor_is_driven():
    plant = Plant(DriverOptions(load_robot('leo')), 13.8, 0.0, hand=True)
    start = plant._state.q.copy()
    plant.run_to(3.0)
    assert plant._state.q.tolist() == start.tolist() and plant.seconds == 3.0
    knee = plant.servos['left_knee']
    for name, value in (('operating_mode', PWM_MODE), ('goal_pwm', 50), ('torque_enable', 1)):
        knee.set(name, value)
    plant.run_to(3.2)
    assert np.abs(plant._state.q - start).max() > 0.01
    plant.start_in('nominal')
    knee.set('torque_enable', 0)
    plant.run_to(4.0)
    assert plant._state.q.tolist() == start.tolist()
