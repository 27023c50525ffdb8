# SPDX-License-Identifier: Apache-2.0
"""The suite for drivers: the good ones pass, and each way to be wrong fails its own check."""

from dataclasses import replace
import json
from pathlib import Path
import re
from threading import Event
import time

import numpy as np
import pytest
from tests.drivers.bus import options, robot_with_servo, running
from tests.drivers.clock import Clock
from tests.drivers.rig import Rig
from tests.places import RIG, ROOT

from leo_msgs_py.cli import main
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.drivers import base, load_driver
from leo_sim.drivers.base import DriverFault, DriverOptions, EndOfRun, NotPossible, TransientFault
from leo_sim.drivers.check import CHECKS, contract, examine, FAILED, PASSED, trial
from leo_sim.drivers.check.trial import Moving, Trial
from leo_sim.drivers.simulated import SimulatedDriver

PENDULUM = load_robot('servo_pendulum')
FULL = Moving(range=0.2, share=1.0)


CLOCK = Clock()


def failures(driver, robot=PENDULUM, moving=None, ask=None, clock=CLOCK):
    """The checks that fail, and what is said of them."""
    results = examine(Trial(driver, robot, moving, ask, clock))
    return {r.name: f'{r.what} / {r.mend}' for r in results if r.verdict == FAILED}


def simulated(kind=SimulatedDriver, **changes):
    return kind(DriverOptions(PENDULUM, engine='rigid', **changes))


def test_the_simulated_driver_passes_everything_that_can_be_tried():
    results = examine(Trial(simulated(), PENDULUM, FULL))
    verdicts = {r.name: r.verdict for r in results}
    assert len(verdicts) == len(CHECKS) and FAILED not in verdicts.values()
    assert verdicts['signs and units'] == verdicts['limits'] == PASSED


class Watched(SimulatedDriver):
    """Keeps what it was told to write."""

    written = ()

    def write(self, values):
        self.written = (*self.written, *values)
        return super().write(values)


def test_nothing_moves_unless_it_is_allowed():
    driver = simulated(Watched)
    assert failures(driver) == {} and driver.written and not any(driver.written)


def changed(**fields):
    """A driver whose states have these fields changed by functions."""

    class Changed(SimulatedDriver):
        def read(self):
            state = super().read()
            return replace(state, **{n: act(getattr(state, n)) for n, act in fields.items()})

    return Changed


@pytest.mark.parametrize('name', ['xl330_pendulum', 'so101'])
def test_a_driver_that_takes_goals_passes_and_nothing_has_a_goal_unless_it_may_move(name):
    robot = load_robot(name)
    still, moved = (Watched(DriverOptions(robot, engine='rigid')) for _ in range(2))
    assert failures(still, robot) == {} and np.isnan(still.written).all()
    assert failures(moved, robot, Moving(range=0.2, share=0.5)) == {}
    goals = np.reshape(moved.written, (-1, len(robot.actuators)))
    assert np.nanmax(np.ptp(goals[np.isfinite(goals).all(axis=1)], axis=0)) <= 0.21


class NeverLetsGo(SimulatedDriver):
    """Takes no goal for the goal 0."""

    def write(self, values):
        return super().write(np.nan_to_num(values))


class GoalsInDegrees(SimulatedDriver):
    def write(self, values):
        return super().write(np.rad2deg(values))


class Uncut(SimulatedDriver):
    """Says that everything was applied."""

    def write(self, values):
        return replace(super().write(values), values=np.array(values))


@pytest.mark.parametrize(
    ('kind', 'check', 'said'),
    [
        (NeverLetsGo, 'writing', 'a goal of NaN frees'),
        (GoalsInDegrees, 'signs and units', 'rad, not deg'),
        (Uncut, 'limits', 'goals to info.goals'),
    ],
)
def test_each_way_to_be_wrong_with_goals(kind, check, said):
    robot = load_robot('xl330_pendulum')
    found = failures(kind(DriverOptions(robot, engine='rigid')), robot, FULL)
    assert said in found.get(check, ''), found


class Offset(SimulatedDriver):
    def write(self, values):
        return super().write(values + 0.1)


class Backwards(SimulatedDriver):
    def write(self, values):
        return replace(super().write(-values), values=np.array(values))


class InCounts(SimulatedDriver):
    """Takes volts for counts of PWM."""

    def write(self, values):
        return super().write(values / 885 * 7.4)


def told(share):
    """A driver that says that this share of what was commanded is applied."""

    class Told(SimulatedDriver):
        def write(self, values):
            applied = super().write(values)
            return replace(applied, values=share * applied.values)

    return Told


class NeverFree(SimulatedDriver):
    def set_torque(self, on):
        """Nothing."""


class Uncounted(SimulatedDriver):
    def reset(self):
        super().reset()
        self.starts -= 1


class Careless(SimulatedDriver):
    def read(self):
        raise KeyError('servo 3')


class Slow(SimulatedDriver):
    def read(self):
        CLOCK.sleep(0.012)
        return super().read()


@pytest.mark.parametrize(
    ('kind', 'check', 'said'),
    [
        (
            changed(position=lambda q: np.rad2deg(q), velocity=lambda w: np.rad2deg(w)),
            'signs and units',
            'rad, not deg',
        ),
        (changed(position=lambda q: -q, velocity=lambda w: -w), 'signs and units', 'sign'),
        (changed(velocity=lambda w: w * 9.55), 'signs and units', 'velocity in rad/s'),
        (changed(velocity=lambda w: -w), 'signs and units', 'velocity in rad/s'),
        (Backwards, 'signs and units', 'commanded up'),
        (InCounts, 'signs and units', 'PWM'),
        (told(0.0), 'signs and units', '0 is said to be applied'),
        (told(-0.1), 'signs and units', 'with its sign'),
        (told(0.1), 'signs and units', 'in its unit'),
        (Uncut, 'limits', 'clip to info.limits'),
        (Offset, 'writing', '0 must stay 0'),
        (NeverFree, 'torque', 'enabled'),
        (Uncounted, 'resetting', 'starts += 1'),
        (changed(names=lambda n: ('other',)), 'shapes', 'info.joints'),
        (changed(position=lambda q: q.astype(int)), 'shapes', 'finite floats'),
        (changed(position=lambda q: np.append(q, 0.0)), 'shapes', 'one value per joint'),
        (changed(velocity=lambda w: w * np.nan), 'shapes', 'finite floats'),
        (changed(stamp_ns=lambda t: 0), 'stamps', 'above the one before'),
        (changed(stamp_ns=lambda t: t * 1e-9), 'stamps', 'int nanoseconds'),
        (changed(stamp_ns=lambda t: t * 1000), 'stamps', 'advance by the seconds'),
        (Careless, 'shapes', 'KeyError'),
        (Slow, 'pace', 'read all at once'),
    ],
)
def test_each_way_to_be_wrong_fails_its_own_check(kind, check, said):
    found = failures(simulated(kind), moving=FULL)
    assert said in found.get(check, ''), found


class MeasuredLate(SimulatedDriver):
    """Measures what is applied, with an error, a period late."""

    before = 0.0

    def write(self, values):
        applied, late = super().write(values), self.before
        self.before = 1.1 * applied.values
        return replace(applied, values=np.clip(late, *self.info.bounds))


def test_what_is_applied_may_be_measured_and_late():
    assert failures(simulated(MeasuredLate), moving=Moving(0.2, 0.9)) == {}


ARM = load_robot('so101')


class Degrees(SimulatedDriver):
    def read(self):
        state = super().read()
        return replace(state, position=np.rad2deg(state.position) + 10.0)


@pytest.mark.parametrize('moving', [None, FULL])
def test_a_robot_far_outside_its_stops_is_told_another_unit(moving):
    found = failures(Degrees(DriverOptions(ARM, engine='rigid')), ARM, moving)
    assert 'outside its stops' in found['signs and units']
    assert 'rad, not deg' in found['signs and units']


@pytest.mark.parametrize(('low', 'high'), [(0, 1), (-1, 0)])
def test_a_joint_that_lies_on_a_stop_is_pushed_away_from_it(tmp_path, low, high):
    urdf, file = ((PENDULUM.folder / f'robot.{kind}').read_text() for kind in ('urdf', 'yaml'))
    stops = f'<limit lower="{low}" upper="{high}" effort="1" velocity="9"/></joint>'
    text = urdf.replace('continuous', 'revolute').replace('</joint>', stops)
    (tmp_path / 'robot.urdf').write_text(text)
    (tmp_path / 'robot.yaml').write_text(re.sub(r'\[-3\S+ 3\S+\]', '0', file))
    robot = load_robot(tmp_path)
    assert failures(SimulatedDriver(DriverOptions(robot, engine='rigid')), robot, FULL) == {}


def test_a_model_that_stays_where_it_is_is_far_from_a_robot_that_moves(tmp_path):
    for name in ('robot.urdf', 'robot.yaml'):
        (tmp_path / name).write_text((PENDULUM.folder / name).read_text())
    with (tmp_path / 'robot.yaml').open('a') as file:
        file.write('\njoints:\n  pivot:\n    friction: {value: 5, unit: N m}\n')
    found = failures(simulated(), load_robot(tmp_path), FULL)
    assert 'the model 0 / look at units' in found['signs and units']


@pytest.fixture
def rig(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda kind=Rig: kind(DriverOptions(PENDULUM, computer=CLOCK))


def test_hardware_that_keeps_to_the_contract_passes(rig):
    assert failures(rig()) == {}


class WithoutHalt(Rig):
    halt = None


class HaltWaits(Rig):
    def halt(self):
        Event().wait()


class OldStamps(Rig):
    def read(self):
        state = super().read()
        return replace(state, stamp_ns=state.stamp_ns - 10**15)


class Waits(Rig):
    def advance(self, seconds):
        CLOCK.sleep(seconds)
        return 2 * seconds


class StopsOnce(Rig):
    def stop(self):
        if self.__dict__.setdefault('stopped', 0) > 1:
            raise ValueError('closed')
        self.stopped += 1


class Unreachable(Rig):
    def connect(self):
        raise UserError('no answer on /dev/ttyUSB0; switch it on')


class Gone(Rig):
    def read(self):
        raise DriverFault('the servo is gone')


class Lossy(Rig):
    count = 0

    def read(self):
        CLOCK.sleep(1e-3)  # a reading takes time
        self.count += 1
        if self.count % 3 == 0:
            raise TransientFault('no answer')
        return super().read()


@pytest.mark.parametrize(
    ('kind', 'check', 'said'),
    [
        (WithoutHalt, 'halting', 'no halt()'),
        (HaltWaits, 'halting', 'take no lock'),
        (OldStamps, 'stamps', 'time.time_ns()'),
        (Waits, 'pace', 'return at once'),
        (StopsOnce, 'stop twice', 'ValueError'),
        (Unreachable, 'connect', 'switch it on'),
        (Gone, 'shapes', 'the servo is gone'),
    ],
)
def test_each_way_of_hardware_to_be_wrong(rig, kind, check, said, monkeypatch):
    if kind is HaltWaits:
        monkeypatch.setattr(contract, 'HALT', 0.1)
    assert said in failures(rig(kind)).get(check, '')


@pytest.mark.parametrize(('name', 'others'), [('read', 'shapes'), ('write', 'stamps')])
def test_a_call_that_hangs_is_said_and_the_rest_is_tried(rig, monkeypatch, name, others):
    def hang(self, *values):
        try:
            time.sleep(60.0)
        except Exception as error:
            raise TransientFault('tries again') from error

    monkeypatch.setattr(trial, 'HANG', 0.02)
    found = failures(rig(type('Hanging', (Rig,), {name: hang})))
    assert f'{name} has not returned after 0.02 s' in found[others]
    assert Path('calls').read_text().split()[-1] == 'stop'


def test_lost_packets_are_counted_not_held_against_it(rig):
    trial = Trial(rig(Lossy), PENDULUM, computer=CLOCK)
    assert FAILED not in {result.verdict for result in examine(trial)} and trial.lost > 10


def test_the_driver_is_stopped_whatever_happens(rig):
    driver = rig(Gone)
    examine(Trial(driver, PENDULUM, computer=CLOCK))
    assert Path('calls').read_text().split()[-1] == 'stop'


def test_a_person_turns_joints_and_pulls_the_cable(rig):
    class Turned(Rig):
        angle = 0.0

        def read(self):
            state = super().read()
            return replace(state, position=state.position + self.angle)

    def person(driver, way, pulled='break'):
        def ask(what):
            if what.startswith('move pivot by the right hand about the axis'):
                driver.angle += way
            else:
                Path('orders').write_text(pulled)

        return ask

    good, bad = rig(Turned), rig(Turned)
    assert failures(good, ask=person(good, 0.3)) == {}
    lost = rig(Turned)
    assert failures(lost, ask=person(lost, 0.3, 'lose 1000')) == {}
    assert 'going down' in failures(bad, ask=person(bad, -0.3))['by hand']
    deaf = rig(Turned)
    ask = person(deaf, 0.3)
    said = failures(deaf, ask=lambda what: ask(what) if 'move' in what else None)
    assert 'its cable is out' in said['unplugged']
    careless = load_driver(str(RIG), DriverOptions(PENDULUM, computer=CLOCK))
    said = failures(careless, ask=lambda what: Path('orders').write_text('bug read'))
    assert 'ValueError: read' in said['unplugged']


def on_bus(name, robot, bus=None):
    """The checks that a driver fails on an emulated bus."""
    bus = bus or running(robot, 7.4)
    driver = load_driver(name, options(robot, bus))
    return failures(driver, robot, FULL, clock=bus.computer)


def test_the_dynamixel_driver_passes_on_the_emulated_bus(tmp_path):
    robot = robot_with_servo(tmp_path, 'servo_pendulum', 'XM430-W210', direction=-1)
    assert on_bus('dynamixel', robot) == {}


@pytest.mark.parametrize(
    ('family', 'model'), [('dynamixel', 'XL330-M288'), ('feetech', 'STS3215')]
)
def test_drivers_that_send_goals_pass_on_the_emulated_bus(tmp_path, family, model):
    robot = robot_with_servo(tmp_path, 'xl330_pendulum', model, family, direction=-1)
    assert on_bus(family, robot) == {}


def test_a_servo_that_is_turned_around_is_found_out(tmp_path):
    """Its direction in robot.yaml is not that of the rig."""
    one = robot_with_servo(tmp_path / '1', 'servo_pendulum', 'XM430-W210', direction=-1)
    other = robot_with_servo(tmp_path / '2', 'servo_pendulum', 'XM430-W210', direction=1)
    bus = running(one, 7.4)
    bus.plant._model = _Reversed(bus.plant._model)
    assert 'signs and units' in on_bus('dynamixel', other, bus)


class _Reversed:
    """A robot whose motor cable is the wrong way round."""

    def __init__(self, model):
        self._model = model

    def __getattr__(self, name):
        return getattr(self._model, name)

    def step(self, state, inputs, dt, enabled=None):
        return self._model.step(state, -np.asarray(inputs), dt, enabled)


def test_the_verb(rig, capsys, monkeypatch):
    monkeypatch.setattr(base, 'time', CLOCK)
    words = ['check-driver', str(RIG), '--robot', 'servo_pendulum']
    assert main(words) == 0
    assert '0 of 15 checks failed' in capsys.readouterr().out
    assert main([*words, '--port', '/dev/my bus']) == 0
    following = capsys.readouterr().out.splitlines()[-1]
    assert following.endswith(f"-p driver:={RIG} -p 'port:=/dev/my bus'")
    assert main([*words, '--json']) == 0
    assert json.loads(capsys.readouterr().out)['failed'] == 0
    assert main([*words, '--move', '--yes']) == 1, 'it stands still'
    assert 'does not move' in ' '.join(capsys.readouterr().out.split())
    monkeypatch.setattr('sys.stdin.isatty', lambda: False)
    assert main([*words, '--move']) == 2
    assert 'give --yes' in capsys.readouterr().err
    assert main(['check-driver', 'nothing', '--robot', 'pendulum']) == 2


def test_the_verb_says_what_servos_are_set_to_and_what_is_not_the_models(
    rig, capsys, monkeypatch, tmp_path
):
    monkeypatch.setattr(base, 'time', CLOCK)
    text = RIG.read_text().replace('import NotPossible', 'import Findings, NotPossible')
    found = "Findings({'servo 1': 'P 7'}, ('servo 1: its P',))"
    file = tmp_path / 'told.py'
    file.write_text(
        text.replace(
            '    def stop(', f'    def findings(self):\n        return {found}\n\n    def stop('
        )
    )
    words = ['check-driver', str(file), '--robot', 'servo_pendulum']
    assert main(words) == 0
    said = capsys.readouterr().out
    assert 'what it is set to' in said and 'P 7' in said and '\nservo 1: its P\n' in said
    assert main([*words, '--json']) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer['servos'] == {'servo 1': 'P 7'} and answer['differs'] == ['servo 1: its P']


def test_a_replayed_bag_that_cannot_be_switched_or_ends_is_no_failure():
    class Recorded(SimulatedDriver):
        def set_torque(self, on):
            raise NotPossible('a recording plays as it is')

        def reset(self):
            raise NotPossible('a recording plays as it is')

        def advance(self, seconds):
            if self._ticks == 60:
                raise EndOfRun('it has ended')
            return super().advance(seconds)

    results = {r.name: r for r in examine(Trial(simulated(Recorded), PENDULUM))}
    assert FAILED not in {r.verdict for r in results.values()}
    assert results['stamps'].verdict == PASSED and results['pace'].what == 'it has ended'


def test_the_driver_that_the_docs_show_passes(tmp_path):
    """docs/your_driver.md, to the letter."""
    page = (ROOT / 'docs/your_driver.md').read_text()
    file = tmp_path / 'my_driver.py'
    file.write_text(page.split('```python\n')[1].split('```')[0])
    robot = robot_with_servo(tmp_path, 'servo_pendulum', 'XL330-M288')
    assert on_bus(str(file), robot) == {}
