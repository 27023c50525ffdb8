# SPDX-License-Identifier: Apache-2.0
"""The simulated robot behind the driver contract, with and without something hidden in it."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from leo_lab.blind import kinds
from leo_msgs_py.errors import UserError
from leo_sim.common import consent
from leo_sim.description.robot import load_robot
from leo_sim.drivers.base import DriverOptions
from leo_sim.drivers.simulated import SimulatedDriver
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.batch import rollout
from leo_sim.truth import drawing
from leo_sim.verbs.reveal import read_sealed


def options(**changes) -> DriverOptions:
    return DriverOptions(**{'robot': load_robot('pendulum'), 'engine': 'rigid', **changes})


def hiding(folder, name, where, **parameters) -> str:
    figures = {key: {'value': value, 'unit': unit} for key, (value, unit) in parameters.items()}
    path = folder / 'hidden.yaml'
    path.write_text(
        yaml.safe_dump({'effects': [{'name': name, 'where': where, 'parameters': figures}]})
    )
    return str(path)


def swing(driver: SimulatedDriver, ticks=50, volts=2.0):
    rows = []
    for _ in range(ticks):
        state, applied = driver.read(), driver.write(np.array([volts]))
        measured = np.concatenate([state.position, state.velocity])
        rows.append((measured.tobytes(), applied.nan_where_free.tobytes()))
        driver.advance(1.0 / driver.info.state_rate)
    return rows


def test_a_seed_repeats_to_the_bit_and_another_does_not():
    given = {'start': 'random', 'noise': (0.001, 0.05)}
    first, again, other = (swing(SimulatedDriver(options(seed=s, **given))) for s in (3, 3, 4))
    assert first == again
    assert first[0] != other[0]


def test_what_goes_by_the_time_goes_on_while_the_robot_is_put_up(tmp_path, monkeypatch):
    monkeypatch.setattr(consent, '_trusted', set())
    warm = str(Path(kinds.__file__).with_name('winding_drift.py'))
    consent.trust(warm)
    hidden = hiding(tmp_path, warm, 'pivot', rise=(1.0, ''), tau=(1.0, 's'))
    driver = SimulatedDriver(options(private={'hidden': hidden}))
    cold = [driver.read().position, swing(driver), driver.read().position][::2]
    swing(driver, ticks=500)
    driver.reset()
    start, end = [driver.read().position, swing(driver), driver.read().position][::2]
    assert start == cold[0]
    assert 0.4 < (end - start) / (cold[1] - cold[0]) < 0.8


def test_noise_is_measured_only_and_has_the_given_size():
    quiet, noisy = (SimulatedDriver(options(noise=n)) for n in ((0.0, 0.0), (0.001, 0.05)))
    errors = []
    for _ in range(400):
        a, b = quiet.read(), noisy.read()
        assert noisy.read() is b, 'a state is measured once'
        errors.append([b.position[0] - a.position[0], b.velocity[0] - a.velocity[0]])
        for driver in (quiet, noisy):
            driver.write(np.array([1.0]))
            driver.advance(0.01)
    assert np.std(errors, axis=0) == pytest.approx([0.001, 0.05], rel=0.15)
    assert np.mean(errors, axis=0) == pytest.approx([0.0, 0.0], abs=0.01)


def test_zero_volts_brakes_and_a_free_motor_does_not():
    braked, free = SimulatedDriver(options()), SimulatedDriver(options())
    free.set_torque(False)
    speeds = []
    for driver in (braked, free):
        driver.set_torque(True)
        swing(driver, 8, volts=3.0)
        driver.set_torque(driver is braked)
        assert driver.write(np.array([0.0])).enabled.tolist() == [driver is braked]
        swing(driver, 30, volts=0.0)
        speeds.append(abs(driver.read().velocity[0]) + abs(driver.read().position[0] - np.pi))
    assert speeds[0] < 0.8 * speeds[1]


def test_reset_starts_anew_one_control_period_later():
    driver = SimulatedDriver(options())
    start = driver.read()
    swing(driver, 10)
    driver.reset()
    assert driver.starts == 1
    assert driver.read().stamp_ns == 100_000_000 + 50_000_000
    assert driver.read().position.tolist() == start.position.tolist()


def test_hidden_effects_act_after_what_is_published(tmp_path):
    weak = hiding(tmp_path, 'voltage_scale', 'pivot', k=(0.5, ''))
    private = {'hidden': weak, 'sealed': str(tmp_path / 'weak.sealed')}
    hidden, ideal = (SimulatedDriver(options(private=p)) for p in (private, {'hidden_seed': -1}))
    assert [row[1] for row in swing(hidden)] == [row[1] for row in swing(ideal)]
    assert abs(hidden.read().position[0] - ideal.read().position[0]) > 0.01
    effects = yaml.safe_load(Path(weak).read_text())['effects']
    assert read_sealed(tmp_path / 'weak.sealed')['effects'] == effects


@pytest.mark.parametrize('robot', ['servo_pendulum', 'double_pendulum'])
@pytest.mark.parametrize(
    ('name', 'parameter', 'value', 'unit'),
    [
        ('encoder_scale', 'k', 1.1, ''),
        ('velocity_lag', 'tau', 0.02, 's'),
        ('measurement_delay', 'delay', 0.013, 's'),
    ],
)
def test_sensors_of_the_driver_are_those_of_a_batch(tmp_path, robot, name, parameter, value, unit):
    hidden, robot = hiding(tmp_path, name, 'all', **{parameter: (value, unit)}), load_robot(robot)
    driver = SimulatedDriver(options(robot=robot, private={'hidden': hidden}))
    inputs = 0.5 * np.random.default_rng(1).uniform(-1, 1, (40, len(robot.limits))) * robot.limits
    read = [driver.read()]
    for number, values in enumerate(inputs):
        driver.set_torque(number % 20 < 15)
        driver.write(values)
        driver.advance(0.01)
        read.append(driver.read())
    enabled = np.repeat(np.arange(40)[:, None] % 20 < 15, len(robot.limits), axis=1)
    model = Model(robot, [place(robot, name, 'all', **{parameter: value})])
    start = np.zeros((1, len(robot.joint_names)))
    q, dq = rollout(model, start, start, inputs[None], 0.01, enabled[None])
    assert q[0] == pytest.approx(np.array([r.position for r in read]), abs=1e-9)
    assert dq[0] == pytest.approx(np.array([r.velocity for r in read]), abs=1e-8)
    ideal, _ = rollout(Model(robot), start, start, inputs[None], 0.01, enabled[None])
    assert (abs(q - ideal).max() > 1e-3) == (name != 'velocity_lag')


def test_a_drawn_effect_repeats_and_is_sealed(tmp_path):
    runs = []
    for name in ('a', 'b'):
        private = {'hidden_seed': 7, 'sealed': str(tmp_path / name)}
        runs.append(swing(SimulatedDriver(options(private=private))))
    assert runs[0] == runs[1]
    assert read_sealed(tmp_path / 'a') == read_sealed(tmp_path / 'b')
    assert len(read_sealed(tmp_path / 'a')['effects']) == 1


@pytest.mark.parametrize('name', ['pendulum', 'torque_pendulum', 'servo_pendulum'])
def test_drawn_effects_differ_and_show(name):
    robot, drawn = load_robot(name), set()
    for seed in range(6):
        placed = drawing.draw(robot, np.random.default_rng(seed))
        drawn.add(placed.effect.name)
        size = drawing.Windows(robot, np.random.default_rng(seed)).size(placed)
        assert drawing.SIZES[0] * 0.9 <= size <= drawing.SIZES[1] * 1.1, placed
    assert len(drawn) >= 3


@pytest.mark.parametrize(
    ('private', 'said'),
    [
        ({'hidden': 'none.yaml'}, 'none.yaml'),
        ({'hidden': 'wrong.yaml'}, 'coulomb_friction'),
        ({'hidden': 'wrong.yaml', 'hidden_seed': 1}, 'give one of them'),
        ({'hidden_seed': -3}, 'hidden_seed takes 0 or more, or -1'),
        ({'hidden_seed': 1, 'sealed': 'wrong.yaml/below'}, 'cannot write the sealed file'),
    ],
)
def test_wrong_hidden_settings_are_one_line(tmp_path, monkeypatch, private, said):
    monkeypatch.chdir(tmp_path)
    Path(hiding(tmp_path, 'coulomb_frictoin', 'pivot')).rename('wrong.yaml')
    with pytest.raises(UserError, match=said) as caught:
        SimulatedDriver(options(private=private))
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    ('change', 'said'),
    [
        ({'state_rate': 33.0}, 'whole multiple of its control rate, 20 Hz'),
        ({'state_rate': float('nan')}, 'whole multiple of its control rate, 20 Hz'),
        ({'state_rate': float('inf')}, 'whole multiple of its control rate, 20 Hz'),
        ({'start': 'upsidedown'}, 'no start pose'),
        ({'engine': 'bulet'}, 'pybullet'),
    ],
)
def test_wrong_options_are_refused(change, said):
    with pytest.raises(UserError, match=said):
        SimulatedDriver(options(**change))


def test_another_start_pose_is_taken_up_at_once_as_after_a_restart():
    driver = SimulatedDriver(options(start='nominal'))
    swing(driver, 10)
    with pytest.raises(UserError, match='no start pose'):
        driver.start_in('upsidedown')
    assert driver.starts == 0 and driver.read().stamp_ns == 100_000_000
    driver.start_in('random')
    first = driver.read()
    driver.reset()
    assert driver.starts == 2 and first.stamp_ns == 0
    assert driver.read().position.tolist() != first.position.tolist()


def test_connecting_compiles_a_step_and_moves_nothing(monkeypatch):
    plain, connected = SimulatedDriver(options()), SimulatedDriver(options())
    steps, step = [], connected._model.step
    monkeypatch.setattr(connected._model, 'step', lambda *a, **k: steps.append(a) or step(*a, **k))
    connected.connect()
    assert len(steps) == 1, 'the first state would wait for the compiler'
    assert swing(connected) == swing(plain)
