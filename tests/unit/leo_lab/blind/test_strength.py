# SPDX-License-Identifier: Apache-2.0
"""How strong an effect must be: curves over lines whose law is known."""

import numpy as np
import pytest
from scipy.special import expit

from leo_lab.blind.strength import fitted, usable

LEVELS, BY_SIZE, BY_TIME = {'weak': -2.0, 'strong': 2.0}, 2.0, 1.0


def lines(count):
    rng = np.random.default_rng(0)
    for _ in range(count):
        name = str(rng.choice([*LEVELS]))
        size, seconds = float(np.exp(rng.uniform(-2, 3))), float(rng.choice([10.0, 20.0, 40.0]))
        z = LEVELS[name] + BY_SIZE * np.log(size) + BY_TIME * np.log(seconds / 20)
        right = bool(rng.random() < expit(z))
        yield {
            'kind': 'strength',
            'robot': 'pendulum',
            'effects': [{'name': name, 'size': size}],
            'data_seconds': seconds,
            'right': right,
            'verdict': 'named' if right else 'fine',
        }


def test_sizes_and_seconds_have_the_chances_that_they_have():
    curves = fitted([*lines(3000)], 'right')
    assert curves.slopes == pytest.approx((BY_SIZE, BY_TIME), rel=0.25)
    for name, level in LEVELS.items():
        half = np.exp(-level / BY_SIZE)
        assert curves.size_for(name, 0.5, 20.0) == pytest.approx(half, rel=0.15)
        assert curves.chance(name, np.array([half]), 20.0) == pytest.approx(0.5, abs=0.1)
        assert curves.size_for(name, 0.9, 40.0) < curves.size_for(name, 0.9, 10.0)


def test_effects_that_are_always_right_have_the_least_size():
    always = [x | {'right': True} for x in lines(50)]
    assert fitted(always, 'right').size_for('weak', 0.9, 20.0) < 0.1


def test_other_lines_are_left_out():
    some = [*lines(2)]
    other = [some[0] | {'kind': 'none'}, some[0] | {'asked': 'leo'}]
    assert usable([*some, *other]) == some
