# SPDX-License-Identifier: Apache-2.0
"""Parameters of the robot node: defaults, forms of the noise, and what is kept private."""

from types import SimpleNamespace

import pytest

from leo_msgs_py.errors import UserError
from leo_sim.nodes.parameters import read_noise, read_settings


class Declared:
    def __init__(self, **given):
        self._parameter_overrides = {n: SimpleNamespace(value=v) for n, v in given.items()}
        self.public = {}

    def declare_parameter(self, name, value, descriptor, ignore_override):
        assert ignore_override and descriptor.read_only == (name != 'start')
        self.public[name] = value
        return SimpleNamespace(value=value)


def test_defaults_run_the_pendulum_in_real_time():
    node = Declared()
    settings = read_settings(node)
    assert settings.options.robot.name == 'pendulum' and settings.driver == 'simulated'
    assert settings.realtime_factor == 1.0 and settings.command_timeout == 0.2
    wanted = 'robot driver start state_rate realtime_factor command_timeout engine'
    assert {*wanted.split(), 'integration_step', 'noise', 'seed'} <= set(node.public)


def test_hidden_effects_are_private():
    node = Declared(hidden='truth.yaml', hidden_seed=3)
    settings = read_settings(node)
    assert not {'hidden', 'hidden_seed'} & set(node.public)
    private = settings.options.private
    assert (private['hidden'], private['hidden_seed']) == ('truth.yaml', 3)


@pytest.mark.parametrize('given', [[0.001, 0.05], [0.0, 0.0], (0, 1)])
def test_noise_is_two_numbers(given):
    assert read_noise(given) == tuple(given)


@pytest.mark.parametrize(
    'noise', [[0.1], [1, 2, 3], 0.1, '0.1', [-1.0, 0.0], [float('nan'), 0.0], ['a', 0.0]]
)
def test_wrong_noise_is_refused(noise):
    with pytest.raises(UserError, match=r'position rad, velocity rad/s'):
        read_noise(noise)


IMPOSSIBLE = {'seed': -1, 'realtime_factor': -1.0, 'state_rate': float('inf'), 'episode': 2**32}


@pytest.mark.parametrize('name', IMPOSSIBLE)
def test_impossible_numbers_are_refused(name):
    with pytest.raises(UserError, match=f'{name} is '):
        read_settings(Declared(**{name: IMPOSSIBLE[name]}))


@pytest.mark.parametrize('given', [{'seed': 0.5}, {'command_timeout': 'soon'}, {'hidden': 3}])
def test_values_of_another_type_are_refused(given):
    with pytest.raises(UserError, match=f"parameter '{next(iter(given))}' must be"):
        read_settings(Declared(**given))
