# SPDX-License-Identifier: Apache-2.0
"""Model.step gives the same bits for the same arguments, whatever came before."""

from functools import cache
import hashlib
import pickle
import subprocess
import sys

import numpy as np
import pytest
from tests.models import modelled

from leo_sim.model import State

PAIRS = 600
PROGRAM = """
import sys; sys.path.insert(0, {folder!r})
from test_purity import digest, model, pairs, run
print(digest(run(model({engine!r}), pairs(), range(0, {count}))))
"""


def model(engine):
    late, slow = ('command_delay', {'delay': 0.013}), ('actuator_lag', {'tau': 0.02})
    dry, loose = ('coulomb_friction', {'c': 1e-3}), ('backlash', {'gap': 0.02})
    return modelled('pendulum', late, slow, dry, loose, engine=engine)


@cache
def pairs():
    rng = np.random.default_rng(0)
    maker = model('rigid')
    result = []
    for i in range(PAIRS):
        state = State(rng.uniform(-4, 4, 1), rng.uniform(-9, 9, 1))
        if i % 2 and i < 400:
            state = maker.step(state, rng.uniform(-3, 3, 1), 0.02)
        result.append((state, rng.uniform(-3, 3, 1), rng.uniform(size=1) > 0.1))
    return result


def run(simulator, given, order):
    each = ((i, *given[i]) for i in order)
    results = {i: simulator.step(state, u, 0.004, enabled=on) for i, state, u, on in each}
    return [results[i] for i in sorted(results)]


def digest(states):
    hashed = hashlib.sha256()
    for state in states:
        hashed.update(state.q.tobytes() + state.dq.tobytes())
        for key in sorted(state.memory):
            hashed.update(key.encode() + np.ascontiguousarray(state.memory[key]).tobytes())
    return hashed.hexdigest()


@pytest.mark.parametrize('engine', ['pybullet', 'rigid'])
def test_shuffled_order_and_a_second_model_give_the_same_bits(engine):
    given, simulator = pairs(), model(engine)
    first = digest(run(simulator, given, range(PAIRS)))
    shuffled = np.random.default_rng(1).permutation(PAIRS).tolist()
    assert digest(run(simulator, given, shuffled)) == first
    assert digest(run(model(engine), given[:200], reversed(range(200)))) == digest(
        run(simulator, given, range(200))
    )


def test_another_process_gives_the_same_bits():
    program = PROGRAM.format(folder=__file__.rsplit('/', 1)[0], engine='pybullet', count=100)
    words = [sys.executable, '-c', program]
    other = subprocess.run(words, capture_output=True, text=True, check=True)
    assert other.stdout.strip() == digest(run(model('pybullet'), pairs(), range(100)))


def test_arguments_are_left_alone():
    simulator, (state, u, on) = model('pybullet'), pairs()[1]
    before = digest([state])
    simulator.step(state, u, 0.004, enabled=on)
    assert digest([state]) == before


def test_model_survives_pickling():
    simulator, (state, u, on) = model('pybullet'), pairs()[0]
    here = simulator.step(state, u, 0.004, enabled=on)
    copy = pickle.loads(pickle.dumps(simulator))
    assert digest([copy.step(state, u, 0.004, enabled=on)]) == digest([here])
