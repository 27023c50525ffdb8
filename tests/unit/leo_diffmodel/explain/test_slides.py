# SPDX-License-Identifier: Apache-2.0
"""At a joint that slides laws are in N and m, are found in their size, and stay in files."""

import numpy as np
import pytest
from tests.robots import CART
from tests.searched import searched
from tests.simulate import record, steps
import yaml

from leo_diffmodel.explain.problem.candidates import candidates, limited
from leo_diffmodel.explain.problem.sizes import scales_of
from leo_diffmodel.explain.settings import SETTINGS
from leo_msgs_py.errors import UserError
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.model_file import load_model

HIDDEN = {
    'coulomb_friction': ({'c': 1.5}, ['N']),
    'viscous_friction': ({'b': 2.0}, ['N s/m']),
    'joint_spring': ({'k': 3.0, 'rest': 0.2}, ['N/m', 'm']),
    'stribeck_friction': ({'c': 1.0, 'c_static': 3.0, 'v_s': 0.3}, ['N', 'N', 'm/s']),
}


@pytest.mark.parametrize('name', HIDDEN)
def test_it_is_named_with_its_size_and_unit(name):
    values, units = HIDDEN[name]
    data = record(CART, place(CART, name, 'rail', **values), seconds=8)
    found = searched([data], Model(CART))
    (top,) = found.chosen.names
    assert (top.label, [p.unit for p in top.parameters]) == (f'{name}:rail', units)
    assert found.final.theta == pytest.approx(list(values.values()), rel=0.15)


def test_a_ripple_has_any_wave_length_of_which_a_period_is_in_the_data():
    effects = [
        place(CART, 'torque_ripple', 'rail', a=1.5, n=21.0, phase=0.4),
        place(CART, 'viscous_friction', 'rail', b=6.0),
    ]
    inputs = 3 * np.sin(0.007 * np.arange(1500))[:, None] + 0.6 * steps(CART, 15, 3)
    found = searched([record(CART, *effects, inputs=inputs, seed=8)], Model(CART))
    assert {c.label for c in found.chosen.names} == {'torque_ripple:rail', 'viscous_friction:rail'}
    ripple = next(c for c in found.chosen.names if c.effect.name == 'torque_ripple')
    assert found.final.own(ripple)[:2] == pytest.approx([1.5, 21.0], rel=0.1)
    sizes = scales_of(found.problem.base, found.problem.windows)
    waves = sizes.shapes('torque_ripple', ripple.parameters[1], SETTINGS.grids)
    assert min(waves) * sizes.length == pytest.approx(2 * np.pi)


def test_limits_are_those_of_a_slide():
    model = Model(CART)
    most = {
        (c.effect.name, p.name): (p.high, p.unit)
        for c in candidates(model)
        for p in limited(c, model, SETTINGS.grids).parameters
    }
    force = 5 * 9.81 * 2
    assert most['coulomb_friction', 'c'] == (pytest.approx(force), 'N')
    assert most['bias_torque', 't'][0] == pytest.approx(force)
    assert most['stribeck_friction', 'v_s'] == (10.0, 'm/s')
    assert most['torque_ripple', 'phase'][1] == 'rad'


def written(folder, unit):
    parameters = {'b': {'value': 2.0, 'unit': unit}}
    effect = {'name': 'viscous_friction', 'where': 'rail', 'parameters': parameters}
    file = folder / 'model.yaml'
    file.write_text(yaml.safe_dump({'robot': str(CART.folder), 'effects': [effect]}))
    return file


def test_files_with_units_of_turning_stay_readable(tmp_path):
    for unit in ('N s/m', 'N m s/rad'):
        (placed,) = load_model(written(tmp_path, unit)).effects
        assert (placed.parameters['b'], placed.units['b']) == (2.0, 'N s/m')
    with pytest.raises(UserError, match="the unit is 'N s/m', found 'N'"):
        load_model(written(tmp_path, 'N'))
