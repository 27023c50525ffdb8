# SPDX-License-Identifier: Apache-2.0
"""Model files: round trip, and one clear line for whatever is wrong in one."""

from pathlib import Path
import re
import shutil

import numpy as np
import pytest
from tests.robots import like, made
import yaml

from leo_msgs_py.errors import UserError
from leo_sim.common.consent import trust
from leo_sim.description.robot import Constant, load_robot
from leo_sim.effects import EFFECTS, place
from leo_sim.model import Model
from leo_sim.model.model_file import load_effects, load_model, save_model, write_effects

ROBOT = load_robot('pendulum')
FRICTION = {
    'name': 'viscous_friction',
    'where': 'pivot',
    'parameters': {'b': {'value': 1e-5, 'unit': 'N m s/rad', 'ci95': [9e-6, 1.1e-5]}},
}
USER_EFFECT = """
from leo_sim.effects import Effect, Parameter
class Wind(Effect):
    name = 'wind'
    family = 'load'
    hook = 'torque'
    parameters = (Parameter('w', 'N m'),)
    def torque(self, p, q, dq, motor, load):
        return p['w'] + 0.0 * q
"""


def write(tmp_path, **content):
    path = tmp_path / 'model.yaml'
    path.write_text(yaml.safe_dump({'robot': 'pendulum', **content}))
    return path


def test_everything_survives_a_round_trip(tmp_path):
    resistance = 'actuators.pivot.resistance'
    path = write(
        tmp_path,
        effects=[FRICTION],
        difference_model='difference.safetensors',
        constants={resistance: {'value': 9.0, 'unit': 'ohm', 'uncertain': [8, 11]}},
        history=[{'added': 'viscous_friction:pivot', 'bags': ['a'], 'error': 0.1}],
    )
    first = load_model(path)
    for model in (first, load_model(save_model(tmp_path / 'copy.yaml', first))):
        assert model.constants[resistance] == model.robot.actuators[0].resistance == 9.0
        assert model.robot.constants[resistance].uncertain == (8.0, 11.0)
        assert model.effects[0].parameters == {'b': 1e-5}
        assert model.effects[0].ci95 == {'b': (9e-6, 1.1e-5)}
        assert model.history[0]['added'] == 'viscous_friction:pivot'
        assert model.difference_model.name == 'difference.safetensors'


@pytest.mark.parametrize('name', sorted(EFFECTS))
def test_every_effect_can_be_written_and_read(tmp_path, name):
    names = 'double_pendulum', 'leo', 'xl330_pendulum'
    robots = ROBOT, *map(load_robot, names)
    robot = next(robot for robot in robots if EFFECTS[name].applies(robot))
    model = Model(robot, [place(robot, name, 'all')])
    assert load_model(save_model(tmp_path / 'model.yaml', model)).effects == model.effects


def test_limits_are_read_and_written(tmp_path):
    limits = {
        'link_mass:bob.m': {'range': [-0.01, 0.05], 'unit': 'kg'},
        'coulomb_friction.c': {'range': [0.0, 0.002], 'unit': 'N m'},
    }
    first = load_model(write(tmp_path, limits=limits))
    second = load_model(save_model(tmp_path / 'copy.yaml', first))
    for model in (first, second, first.changed(engine='rigid')):
        assert model.limits == {key: tuple(limit['range']) for key, limit in limits.items()}


@pytest.mark.parametrize(
    ('key', 'limit', 'words'),
    [
        ('coulomb_fricton.c', ([0.0, 1.0], 'N m'), 'did you mean coulomb_friction'),
        ('coulomb_friction.k', ([0.0, 1.0], 'N m'), "has no 'k'"),
        ('coulomb_friction:bob.c', ([0.0, 1.0], 'N m'), 'does not act there; known: pivot'),
        ('coulomb_friction.c', ([0.0, 1.0], 'Nm'), "the unit is 'N m', found 'Nm'"),
        ('coulomb_friction.c', ([1.0, 0.0], 'N m'), 'no range'),
        ('torque_scale.k', ([1.1, 2.0], ''), 'which is no effect'),
    ],
)
def test_limits_that_are_none_are_refused(tmp_path, key, limit, words):
    ends, unit = limit
    path = write(tmp_path, limits={key: {'range': ends, 'unit': unit}})
    with pytest.raises(UserError, match=r'model\.yaml: ') as told:
        load_model(path)
    assert words in str(told.value)


def test_a_model_is_never_overwritten(tmp_path):
    path = write(tmp_path)
    before = path.read_text()
    with pytest.raises(UserError, match='new file'):
        save_model(path, Model(ROBOT))
    assert path.read_text() == before


def test_a_robot_folder_beside_the_file(tmp_path):
    folder = like(ROBOT, tmp_path / 'mine').folder
    model = load_model(write(tmp_path, robot='mine'))
    assert model.robot.folder == folder
    assert yaml.safe_load(save_model(tmp_path / 'new.yaml', model).read_text())['robot'] == 'mine'


def with_a_robot_folder(tmp_path):
    arm = tmp_path / 'here/arm'
    shutil.copytree(load_robot('pendulum').folder, arm)
    (tmp_path / 'here/out').mkdir()
    return save_model(tmp_path / 'here/out/m.yaml', Model(load_robot(arm)))


def test_a_model_and_its_robot_can_move_together(tmp_path):
    assert yaml.safe_load(with_a_robot_folder(tmp_path).read_text())['robot'] == '../arm'
    (tmp_path / 'here').rename(tmp_path / 'there')
    moved = load_model(tmp_path / 'there/out/m.yaml')
    assert moved.robot.folder.resolve() == (tmp_path / 'there/arm').resolve()


def test_a_robot_at_an_absolute_path_is_read_and_said_where_it_is_not(tmp_path):
    path = with_a_robot_folder(tmp_path)
    path.write_text(f'robot: {tmp_path}/here/arm\n')
    assert load_model(path).robot.name == 'pendulum'
    (tmp_path / 'here/arm').rename(tmp_path / 'here/leg')
    with pytest.raises(UserError, match=r'm.yaml: robot: .* there is no folder .*/arm; '):
        load_model(path)


def test_an_effect_of_the_user(tmp_path):
    (tmp_path / 'wind.py').write_text(USER_EFFECT)
    trust(str(tmp_path / 'wind.py'))
    wind = {'name': 'wind.py', 'where': 'all', 'parameters': {'w': {'value': 1e-3, 'unit': 'N m'}}}
    model = load_model(write(tmp_path, effects=[wind]))
    both = Model(ROBOT), model
    still, blown = (m.step(m.state_from([3.1], [0.0]), [0.0], 0.05).dq[0] for m in both)
    assert blown - still == pytest.approx(1e-3 * 0.05 / 0.000191, rel=0.1)
    assert load_model(save_model(tmp_path / 'copy.yaml', model)).effects[0].effect.name == 'wind'
    assert yaml.safe_load((tmp_path / 'copy.yaml').read_text())['effects'][0]['name'] == 'wind.py'
    (tmp_path / 'sub').mkdir()
    far = save_model(tmp_path / 'sub' / 'far.yaml', model)
    assert load_model(far).effects[0].effect.source == str(tmp_path / 'wind.py')


def test_effects_lists_for_hidden_effects(tmp_path):
    path = tmp_path / 'hidden.yaml'
    placed = place(ROBOT, 'coulomb_friction', 'pivot', c=1e-3)
    path.write_text(yaml.safe_dump({'effects': write_effects([placed])}))
    assert load_effects(path, ROBOT) == (placed,)


def entry(**changes):
    return [{**FRICTION, **changes}]


def with_b(**changes):
    return entry(parameters={'b': {'value': 1e-5, 'unit': 'N m s/rad', **changes}})


@pytest.mark.parametrize(
    ('content', 'said'),
    [
        ({'effects': entry(name='viscous_frction')}, ['effects[0]', 'viscous_friction?']),
        ({'effects': entry(where='elbow')}, ['effects[0]', "'elbow'", 'pivot']),
        ({'effects': with_b(unit='N m')}, ['viscous_friction.b', "'N m s/rad'", "'N m'"]),
        ({'effects': with_b(value=True)}, ['b.value', 'a number is wanted']),
        ({'effects': with_b(ci95=[2.0, 1.0])}, ['b.ci95', 'the lower bound comes first']),
        ({'effects': with_b(value=-1.0)}, ['viscous_friction.b', '-1']),
        ({'effects': entry(parameters={'mu': {'value': 1, 'unit': ''}})}, ["'mu'", 'it has: b']),
        (
            {'effects': entry(parameters={'b': {'value': 1}})},
            ['effects.0.parameters.b.unit', 'missing'],
        ),
        ({'effects': with_b(value='much')}, ['effects.0.parameters.b.value']),
        ({'robot': 'pendulm'}, ["'pendulm'", 'pendulum?']),
        ({'colour': 'red'}, ['colour', 'unknown key']),
        ({'constants': {'links.bob.mas': {'value': 1, 'unit': 'kg'}}}, ['links.bob.mass?']),
        ({'constants': {'links.bob.mass': {'value': 1, 'unit': 'g'}}}, ["'kg'", "'g'"]),
    ],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path, content, said):
    with pytest.raises(UserError) as error:
        load_model(write(tmp_path, **content))
    message = str(error.value)
    assert '\n' not in message
    assert [part for part in said if part not in message] == []


@pytest.mark.parametrize('text', ['robot: [', '- a list', '', '\xff'])
def test_a_file_that_is_no_model(tmp_path, text):
    path = tmp_path / 'model.yaml'
    path.write_bytes(text.encode('latin-1'))
    with pytest.raises(UserError, match=r'model\.yaml') as error:
        load_model(path)
    assert '\n' not in str(error.value)


def test_back_emf_needs_a_voltage():
    robot = load_robot('torque_pendulum')
    assert not EFFECTS['back_emf_scale'].applies(robot)
    with pytest.raises(UserError, match='torque input'):
        place(robot, 'back_emf_scale', 'all', k=1.1)


def test_units_and_neutral_values_follow_the_robot():
    limit = EFFECTS['voltage_limit']
    (volts,) = limit.parameters_for(ROBOT, ('pivot',))
    (torque,) = limit.parameters_for(load_robot('torque_pendulum'), ('pivot',))
    assert (volts.unit, volts.neutral) == ('V', 3.0)
    assert (torque.unit, torque.neutral) == ('N m', 6.0)


def test_constants_given_to_the_robot_or_the_model_are_written(tmp_path):
    changed = {'gravity': Constant('gravity', 9.8, 'm/s2', (9.7, 9.9))}
    heavier = Model(ROBOT.with_constants(changed), constants={'links.bob.mass': 0.06})
    model = load_model(save_model(tmp_path / 'm.yaml', heavier))
    assert model.robot.constants['gravity'] == changed['gravity']
    assert np.isclose(model.laws.gravity, 9.8) and model.constants['links.bob.mass'] == 0.06


@pytest.mark.parametrize(
    ('path', 'value'),
    [
        ('actuators.pivot.resistance', 0.0),
        ('actuators.pivot.resistance', 1e-300),
        ('actuators.pivot.torque_constant', -1.0),
        ('actuators.pivot.limit', 1e308),
        ('actuators.pivot.limit', -3.0),
        ('actuators.pivot.supply', 0.0),
        ('actuators.pivot.rotor_inertia', -1e-6),
        ('links.bob.mass', 0.0),
        ('links.bob.mass', -1.0),
        ('links.bob.inertia', -1e-4),
        ('joints.pivot.damping', -1.0),
        ('gravity', 1e300),
    ],
)
def test_what_no_robot_has_is_refused_in_robots_models_and_ranges(path, value, tmp_path):
    unit = ROBOT.constants[path].unit
    said = re.escape(f'{path}: {value:g} {unit} is not within')
    usual = ROBOT.constants[path].value
    around = [min(value, usual), max(value, usual)]
    for quantity in ({'value': value}, {'value': usual, 'uncertain': around}):
        quantity['unit'] = unit
        with pytest.raises(UserError, match=rf'model\.yaml: constants: {said}'):
            load_model(write(tmp_path, constants={path: quantity}))
        with pytest.raises(UserError, match=rf'robot\.yaml: {said}'):
            with_figure(tmp_path / 'mine', path, quantity)


def with_figure(folder: Path, path: str, quantity: dict) -> None:
    content = yaml.safe_load((ROBOT.folder / 'robot.yaml').read_text())
    *groups, key = path.split('.')
    part = content
    for group in groups:
        part = part.setdefault(group, {})
    part[key] = quantity
    made(folder, ROBOT.urdf, yaml.safe_dump(content))


@pytest.mark.parametrize('name', ['x' * 300, 'a\0b', 'x' * 300 + '/y'])
def test_names_that_no_file_can_have_are_one_line(name, tmp_path):
    effect = {'name': f'{name}.py', 'where': 'all', 'parameters': {}}
    for load in (
        lambda: load_robot(name),
        lambda: load_model(name),
        lambda: load_model(f'{name}.yaml'),
        lambda: load_model(write(tmp_path, robot=name)),
        lambda: load_model(write(tmp_path, effects=[effect])),
    ):
        with pytest.raises(UserError):
            load()


def test_a_star_stands_for_every_joint_and_gives_way_to_one(tmp_path):
    gain, own = {'value': 3.0, 'unit': '1/rad'}, {'value': 4.0, 'unit': '1/rad'}
    given = {'actuators.gripper.position_gain': own, 'actuators.*.position_gain': gain}
    model = load_model(write(tmp_path, robot='so101', constants=given))
    gains = {n: v for n, v in model.constants.items() if n.endswith('.position_gain')}
    assert gains.pop('actuators.gripper.position_gain') == 4.0
    assert len(gains) == 5 and set(gains.values()) == {3.0}
    assert load_model(save_model(tmp_path / 'again.yaml', model)).constants == model.constants
    wrong = write(tmp_path, robot='so101', constants={'actuators.*.position_gian': gain})
    with pytest.raises(UserError, match=r"no constant 'actuators\.\*\.position_gian'; did you"):
        load_model(wrong)


def test_a_shipped_model_goes_by_its_name_unless_a_file_has_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load_model('so101_bam').effects[0].effect.name == 'command_delay'
    saved = save_model(tmp_path / 'saved.yaml', load_model('so101_bam'))
    assert yaml.safe_load(saved.read_text())['robot'] == 'so101'
    saved.rename(tmp_path / 'so101_bam')
    (tmp_path / 'so101_bam').write_text('robot: pendulum\n')
    assert load_model('so101_bam').robot.name == 'pendulum'
    with pytest.raises(UserError, match=r"no robot or model is named 'so101_bm', .* so101_bam"):
        load_model('so101_bm')
