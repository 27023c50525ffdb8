# SPDX-License-Identifier: Apache-2.0
"""The suite for drivers: the good ones pass, and each way to be wrong fails its own check."""

from dataclasses import replace
import json

import numpy as np
import pytest
from tests.drivers.trial import CLOCK, failures, FULL, PENDULUM
from tests.places import RIG
from tests.robots import like

from leo_msgs_py.cli import main
from leo_sim.description.robot import load_robot
from leo_sim.drivers.base import DriverOptions, EndOfRun, NotPossible
from leo_sim.drivers.check import CHECKS, examine, FAILED, PASSED
from leo_sim.drivers.check.trial import Moving, Trial
from leo_sim.drivers.simulated import SimulatedDriver


def simulated(kind=SimulatedDriver, robot=PENDULUM):
    return kind(DriverOptions(robot, engine='rigid'))


def test_the_simulated_driver_passes_everything_that_can_be_tried():
    verdicts = {r.name: r.verdict for r in examine(Trial(simulated(), PENDULUM, FULL))}
    assert len(verdicts) == len(CHECKS) and FAILED not in verdicts.values()
    assert verdicts['signs and units'] == verdicts['limits'] == PASSED


class Watched(SimulatedDriver):
    written = ()

    def write(self, values):
        self.written = (*self.written, *values)
        return super().write(values)


def test_nothing_moves_unless_it_is_allowed():
    driver = simulated(Watched)
    assert failures(driver) == {} and driver.written and not any(driver.written)


def changed(**fields):
    class Changed(SimulatedDriver):
        def read(self):
            state = super().read()
            return replace(state, **{n: act(getattr(state, n)) for n, act in fields.items()})

    return Changed


@pytest.mark.parametrize('name', ['xl330_pendulum', 'so101'])
def test_a_driver_that_takes_goals_passes_and_nothing_has_a_goal_unless_it_may_move(name):
    robot = load_robot(name)
    still, moved = (simulated(Watched, robot) for _ in range(2))
    assert failures(still, robot) == {} and np.isnan(still.written).all()
    assert failures(moved, robot, Moving(range=0.2, share=0.5)) == {}
    goals = np.reshape(moved.written, (-1, len(robot.actuators)))
    assert np.nanmax(np.ptp(goals[np.isfinite(goals).all(axis=1)], axis=0)) <= 0.21


def commanded(act, applied=lambda applied, values: applied):
    class Commanded(SimulatedDriver):
        def write(self, values):
            return applied(super().write(act(values)), values)

    return Commanded


def told(share):
    return commanded(np.array, lambda said, _: replace(said, values=share * said.values))


def as_asked(applied, values):
    return replace(applied, values=np.array(values))


@pytest.mark.parametrize(
    ('kind', 'check', 'said'),
    [
        (commanded(np.nan_to_num), 'writing', 'a goal of NaN frees'),
        (commanded(np.rad2deg), 'signs and units', 'rad, not deg'),
        (commanded(np.array, as_asked), 'limits', 'goals to info.goals'),
    ],
)
def test_each_way_to_be_wrong_with_goals(kind, check, said):
    robot = load_robot('xl330_pendulum')
    found = failures(simulated(kind, robot), robot, FULL)
    assert said in found.get(check, ''), found


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
        (changed(position=np.rad2deg, velocity=np.rad2deg), 'signs and units', 'rad, not deg'),
        (changed(position=np.negative, velocity=np.negative), 'signs and units', 'sign'),
        (changed(velocity=lambda w: w * 9.55), 'signs and units', 'velocity in rad/s'),
        (changed(velocity=np.negative), 'signs and units', 'velocity in rad/s'),
        (commanded(np.negative, as_asked), 'signs and units', 'commanded up'),
        (commanded(lambda volts: volts / 885 * 7.4), 'signs and units', 'PWM'),
        (told(0.0), 'signs and units', '0 is said to be applied'),
        (told(-0.1), 'signs and units', 'with its sign'),
        (told(0.1), 'signs and units', 'in its unit'),
        (commanded(np.array, as_asked), 'limits', 'clip to info.limits'),
        (commanded(lambda volts: volts + 0.1), 'writing', '0 must stay 0'),
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
    before = 0.0

    def write(self, values):
        applied, late = super().write(values), self.before
        self.before = 1.1 * applied.values
        return replace(applied, values=np.clip(late, *self.info.bounds))


def test_what_is_applied_may_be_measured_and_late():
    assert failures(simulated(MeasuredLate), moving=Moving(0.2, 0.9)) == {}


ARM = load_robot('so101')


@pytest.mark.parametrize('moving', [None, FULL])
def test_a_robot_far_outside_its_stops_is_told_another_unit(moving):
    degrees = changed(position=lambda q: np.rad2deg(q) + 10.0)
    found = failures(simulated(degrees, ARM), ARM, moving)
    assert 'outside its stops' in found['signs and units']
    assert 'rad, not deg' in found['signs and units']


@pytest.mark.parametrize(('low', 'high'), [(0, 1), (-1, 0)])
def test_a_joint_that_lies_on_a_stop_is_pushed_away_from_it(tmp_path, low, high):
    stops = f'"revolute"><limit lower="{low}" upper="{high}" effort="1" velocity="9"/>'
    starts = '[-3.141592653589793, 3.141592653589793]', '0'
    robot = like(PENDULUM, tmp_path, ('"continuous">', stops), starts)
    assert failures(simulated(SimulatedDriver, robot), robot, FULL) == {}


def test_a_model_that_stays_where_it_is_is_far_from_a_robot_that_moves(tmp_path):
    end = 'reward:', 'joints:\n  pivot:\n    friction: {value: 5, unit: N m}\nreward:'
    found = failures(simulated(), like(PENDULUM, tmp_path, end), FULL)
    assert 'the model 0 / look at units' in found['signs and units']


def test_the_verb(rig, capsys, monkeypatch):
    words = ['check-driver', str(RIG), '--robot', 'servo_pendulum']
    assert main([*words, '--port', '/dev/my bus']) == 0
    *_, failed, following = capsys.readouterr().out.splitlines()
    assert failed == '0 of 9 checks failed; 6 were left out'
    assert following.endswith(f"-p driver:={RIG} -p 'port:=/dev/my bus'")
    assert main([*words, '--json']) == 0
    assert json.loads(capsys.readouterr().out)['failed'] == 0
    assert main([*words, '--move', '--yes']) == 1, 'it stands still'
    assert 'does not move' in ' '.join(capsys.readouterr().out.split())
    monkeypatch.setattr('sys.stdin.isatty', lambda: False)
    assert main([*words, '--move']) == 2
    assert 'give --yes' in capsys.readouterr().err
    assert main(['check-driver', 'nothing', '--robot', 'pendulum']) == 2


def test_the_verb_says_what_servos_are_set_to_and_what_is_not_the_models(rig, capsys, tmp_path):
    text = RIG.read_text().replace('import NotPossible', 'import Findings, NotPossible')
    found = "Findings({'servo 1': 'P 7'}, ('servo 1: its P',))"
    file = tmp_path / 'told.py'
    method = f'    def findings(self):\n        return {found}\n\n'
    file.write_text(text.replace('    def stop(', f'{method}    def stop('))
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
