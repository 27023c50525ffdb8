# SPDX-License-Identifier: Apache-2.0
"""Who may import whom (the table in README, How it works), read from the source."""
import ast
from collections.abc import Iterator
from functools import cache
import re
import subprocess
import sys

import pytest
from tests.places import ROOT

# Each may import those before it.
OURS = ('leo_msgs_py', 'leo_sim', 'leo_diffmodel', 'leo_learner')
MODULES = {
    '.'.join(path.relative_to(ROOT / 'src' / package).with_suffix('').parts).removesuffix(
        '.__init__'
    ): path
    for package in OURS
    for path in sorted((ROOT / 'src' / package / package).rglob('*.py'))
}
SOURCES = [
    path
    for pattern in ('src/**/*.py', 'tests/**/*.py', 'benchmarks/**/*.py')
    for path in sorted(ROOT.glob(pattern))
]
TRUTH = 'leo_sim.truth.hidden'
MAY_SEE_THE_TRUTH = {'leo_sim.drivers.simulated', 'leo_sim.verbs.reveal'}
ENGINES = {'pybullet': 'leo_sim.dynamics.pybullet', 'mujoco': 'leo_sim.references.mujoco'}
ROS = {
    'rclpy', 'builtin_interfaces', 'control_msgs', 'diagnostic_msgs', 'rcl_interfaces',
    'rosgraph_msgs', 'sensor_msgs', 'std_msgs', 'std_srvs', 'type_description_interfaces',
}  # fmt: skip
NEED_ROS = (
    'leo_msgs_py.hostile',
    'leo_msgs_py.node',
    'leo_msgs_py.serialized',
    'leo_msgs_py.topics',
    'leo_sim.nodes',
    'leo_diffmodel.bags.play',
    'leo_diffmodel.bags.record',
    'leo_diffmodel.difference.service',
    'leo_diffmodel.nodes',
    'leo_learner.nodes',
    'leo_learner.robot_env',
    'leo_learner.run_player',
    'leo_learner.running_robot',
)
"""What cannot be imported without ROS; everything else can."""
MAX_FUNCTION_LINES = 60
DRIVERS = 'leo_sim.drivers'
HARDWARE = (DRIVERS, 'leo_sim.description.servos', 'dynamixel_sdk', 'scservo_sdk')
ANY_DRIVER = tuple(f'{DRIVERS}.{name}'
                   for name in ('base', 'safety', 'goal_safety', 'faults', 'apart', 'check'))
"""What every driver has; what stands between it and a command; the suite that tries any."""
ONE_DRIVER = (DRIVERS, 'leo_sim.description', 'leo_sim.verbs.skeleton', 'leo_sim.verbs.robot',
              'leo_sim.nodes.servo_bus')
"""What knows of servos: drivers, their bus, robot.yaml and what writes it."""
LOADERS = ('leo_sim.nodes.robot', 'leo_sim.verbs.check_driver')
"""What builds a driver by its name."""
BLIND = 'leo_diffmodel.blind'
"""Makes its cases on the simulated driver, whatever runs elsewhere."""
KINDS = ('dynamixel', 'feetech', 'replay')
EXPLAIN = 'leo_diffmodel.explain'
ANSWER = ('unknown', 'decide', 'tell', 'explanation')
LATER_ROOMS = {
    'problem': ('select', *ANSWER),
    'estimate': ('select', *ANSWER),
    'select': ANSWER,
    'unknown': ('tell', 'explanation'),
    'decide': ('unknown', 'tell', 'explanation'),
    'tell': ('unknown', 'explanation'),
}
"""What each part of explain must not load: the answer comes after the search. The files of problem
and estimate lie between each other, in no circle."""


ROOMS = (
    'common', 'description', 'kinematics', 'effects', 'laws', 'dynamics', 'references', 'model',
    'export', 'task', 'truth', 'drivers', 'nodes', 'verbs',
)  # fmt: skip
"""The rooms of leo_sim; each may import those before it, late imports included."""
KEPT_PATHS = {'leo_sim.model_file'}
"""Outside any room, because programs of users import from there."""


def imports(source: str, module: str, top_level_only: bool = False) -> Iterator[str]:
    """Yield every module `source` imports, as absolute names (`from a import b`: a and a.b)."""
    tree = ast.parse(source)
    is_package = module in MODULES and MODULES[module].name == '__init__.py'
    for node in _on_import(tree) if top_level_only else ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parents = module.split('.')[: None if is_package and node.level == 1 else -node.level]
            base = '.'.join([*(parents if node.level else []), *filter(None, [node.module])])
            yield base
            yield from (f'{base}.{alias.name}' for alias in node.names)


def _on_import(node: ast.AST) -> Iterator[ast.AST]:
    """Walk the statements that run when the module is imported."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue
        if isinstance(child, ast.If) and 'TYPE_CHECKING' in ast.dump(child.test):
            continue
        yield child
        yield from _on_import(child)


def within(name: str, package: str) -> bool:
    """Tell whether dotted `name` is `package` or lies in it."""
    return name == package or name.startswith(f'{package}.')


def forbidden(module: str, source: str) -> list[str]:
    """Name every import of `source` that the rules do not allow it."""
    package = module.split('.')[0]
    later = OURS[OURS.index(package) + 1 :]
    found = []
    for name in imports(source, module):
        if any(within(name, other) for other in later):
            found.append(f'{name}: {package} comes before it')
        for engine, at in ENGINES.items():
            if name.split('.')[0].startswith(engine) and module != at:
                found.append(f'{name}: {at} alone imports it')
        if within(name, TRUTH) and module not in MAY_SEE_THE_TRUTH | {TRUTH}:
            found.append(f'{name}: the truth stays with the simulated driver and leo reveal')
    if not any(within(module, known) for known in NEED_ROS):
        found += [
            f'{name}: {module} does without ROS when it is imported'
            for name in imports(source, module, top_level_only=True)
            if name.split('.')[0] in ROS
        ]
    return found


@cache
def loaded_by(module: str) -> tuple[str, ...]:
    """Name every module that importing `module` of ours imports in turn, parents included."""
    names = imports(MODULES[module].read_text(), module, top_level_only=True)
    parts = [name.split('.') for name in names]
    return tuple(dict.fromkeys('.'.join(p[:n]) for p in parts for n in range(1, len(p) + 1)))


def reached_from(start: str) -> dict[str, str]:
    """Map every module loaded when `start` is imported to the one of ours that loads it."""
    reached, queue = {start: ''}, [start]
    while queue:
        module = queue.pop()
        if module not in MODULES:
            continue
        for name in loaded_by(module):
            if name not in reached:
                reached[name] = module
                queue.append(name)
    return reached


def test_imports_are_allowed() -> None:
    found = {module: forbidden(module, path.read_text()) for module, path in MODULES.items()}
    assert {module: names for module, names in found.items() if names} == {}


@pytest.mark.parametrize(
    ('module', 'source'),
    [
        ('leo_msgs_py.topics', 'import leo_sim'),
        ('leo_sim.model', 'from leo_diffmodel.bags import recording'),
        ('leo_diffmodel.explain.main', 'def f():\n    import leo_learner.ddpg'),
        ('leo_sim.model', 'import pybullet as p'),
        ('leo_sim.model', 'import pybullet_data'),
        ('leo_sim.model', 'import mujoco'),
        ('leo_sim.nodes.robot', 'from leo_sim.truth import hidden'),
        ('leo_sim.nodes.robot', 'from ..truth import hidden'),
        ('leo_diffmodel.explain.main', 'from leo_sim.truth.hidden import draw'),
        ('leo_sim.drivers.simulated', 'import rclpy.node'),
        ('leo_msgs_py.values', 'from sensor_msgs.msg import JointState'),
    ],
)
def test_a_forbidden_import_is_noticed(module: str, source: str) -> None:
    assert len(forbidden(module, source)) >= 1


def test_ros_is_loaded_only_by_what_needs_it() -> None:
    without = [m for m in MODULES if not any(within(m, known) for known in NEED_ROS)]
    loaded = {m: [r for r in reached_from(m) if r.split('.')[0] in ROS] for m in without}
    assert {module: names for module, names in loaded.items() if names} == {}


@pytest.mark.parametrize('known', NEED_ROS)
def test_what_needs_ros_is_still_there(known: str) -> None:
    modules = [m for m in MODULES if within(m, known)]
    assert any('rclpy' in reached_from(m) for m in modules)


def test_explain_never_loads_torch() -> None:
    verbs = [m for m in MODULES if within(m, 'leo_diffmodel.explain')]
    assert verbs, 'leo_diffmodel/explain is gone; name its successor here'
    loaded = {m: reached_from(m) for m in verbs}
    assert {m: r['torch'] for m, r in loaded.items() if 'torch' in r} == {}


def test_compare_never_fits() -> None:
    start = ('leo_diffmodel.verbs.compare', 'leo_diffmodel.report.compared')
    for module in start:
        loaded = reached_from(module)
        fits = {m: by for m, by in loaded.items() if within(m, EXPLAIN) and m != EXPLAIN}
        assert fits == {}, f'{module} loads what fits'


def test_the_package_of_explain_itself_loads_nothing() -> None:
    assert loaded_by(EXPLAIN) == ()


def test_python_offers_the_commands_as_functions_without_torch() -> None:
    code = (
        'import sys\n'
        'from leo_diffmodel.explain.settings import SETTINGS\n'
        'from leo_diffmodel import add, compare, explain, read_bag\n'
        'assert all(map(callable, (add, compare, explain, read_bag)))\n'
        "assert not {'torch', 'rclpy', 'numba'} & sys.modules.keys()\n"
    )
    subprocess.run([sys.executable, '-c', code], check=True, timeout=120)


def test_a_fit_is_noticed_where_it_is_loaded() -> None:
    assert 'leo_diffmodel.explain.estimate.fit' in reached_from('leo_diffmodel.report.explained')


def loaded_directly(module: str) -> set[str]:
    """Name the modules of explain that one of them loads, packages left out."""
    return {
        name
        for name in loaded_by(module)
        if within(name, EXPLAIN) and name != module and name in MODULES
        and MODULES[name].name != '__init__.py'
    }  # fmt: skip


@pytest.mark.parametrize('room', LATER_ROOMS)
def test_a_room_of_explain_loads_nothing_of_a_later_one(room: str) -> None:
    files = [m for m in MODULES if within(m, f'{EXPLAIN}.{room}')]
    later = LATER_ROOMS[room]
    assert files and all(any(within(m, f'{EXPLAIN}.{r}') for m in MODULES) for r in later)
    assert {(m, n) for m in files for n in loaded_directly(m)
            if any(within(n, f'{EXPLAIN}.{r}') for r in later)} == set()  # fmt: skip


def test_no_files_of_explain_load_each_other_in_a_circle() -> None:
    """Take away what loads nothing that is left, until nothing is left."""
    left = {m: loaded_directly(m) for m in MODULES if within(m, EXPLAIN)}
    while free := {m for m, loads in left.items() if not loads & left.keys()}:
        left = {m: loads for m, loads in left.items() if m not in free}
    assert left == {}


def room(name: str) -> str:
    """The room of a dotted name of leo_sim; '' outside it."""
    package, _, rest = name.partition('.')
    return rest.split('.')[0] if package == 'leo_sim' else ''


def later_rooms(module: str, source: str) -> set[str]:
    """What a module of leo_sim imports from rooms after its own, anywhere in its source."""
    after = ROOMS[ROOMS.index(room(module)) + 1 :]
    return {name for name in imports(source, module) if room(name) in after}


SIM = sorted(m for m in MODULES if within(m, 'leo_sim') and m not in {'leo_sim', *KEPT_PATHS})


def test_a_room_of_the_simulator_imports_only_those_before_it() -> None:
    found = {module: later_rooms(module, MODULES[module].read_text()) for module in SIM}
    assert {module: names for module, names in found.items() if names} == {}


def test_every_room_of_the_simulator_is_there() -> None:
    assert {room(m) for m in SIM} == set(ROOMS)


def test_a_later_room_is_noticed() -> None:
    late = 'def f():\n    from leo_sim.dynamics.ground import Spheres'
    assert later_rooms('leo_sim.laws.laws', late) == {
        'leo_sim.dynamics.ground', 'leo_sim.dynamics.ground.Spheres'}  # fmt: skip


def test_no_files_of_the_simulator_load_each_other_in_a_circle() -> None:
    """Take away what loads nothing that is left, until nothing is left; packages left out."""
    files = {m for m in SIM if MODULES[m].name != '__init__.py'}
    left = {m: files & set(loaded_by(m)) - {m} for m in files}
    while free := {m for m, loads in left.items() if not loads & left.keys()}:
        left = {m: loads for m, loads in left.items() if m not in free}
    assert left == {}


def of_one_driver(module: str, source: str) -> list[str]:
    """Name what a module knows of which driver runs: imports, and drivers' names as texts."""
    loads = [DRIVERS, f'{DRIVERS}.load_driver'] if module in LOADERS else []
    found = [name for name in imports(source, module)
             if any(within(name, place) for place in HARDWARE)
             and not any(within(name, place) for place in ANY_DRIVER) and name not in loads]
    texts = [node.value for node in ast.walk(ast.parse(source))
             if isinstance(node, ast.Constant) and node.value in KINDS]
    return [*found, *texts]


def test_nobody_but_drivers_knows_which_driver_runs() -> None:
    """Learner, recorder, play, Algorithm 5 and all verbs are the same with every driver."""
    others = [m for m in MODULES if not any(within(m, p) for p in (*ONE_DRIVER, BLIND))]
    known = {module: of_one_driver(module, MODULES[module].read_text()) for module in others}
    assert {module: names for module, names in known.items() if names} == {}


@pytest.mark.parametrize('source', [
    "if driver == 'dynamixel':\n    pass",
    'from leo_sim.drivers.dynamixel import DynamixelDriver',
    'from leo_sim.drivers import load_driver',
    'import scservo_sdk',
])
def test_a_branch_on_the_driver_is_noticed(source: str) -> None:
    assert of_one_driver('leo_learner.learning', source)


def test_torch_is_noticed_where_it_is_loaded() -> None:
    assert 'torch' in reached_from('leo_learner.ddpg')


def test_files_start_with_their_licence() -> None:
    licence = re.compile(r'(#!.*\n)?# SPDX-License-Identifier: Apache-2\.0\n')
    assert [path for path in SOURCES if not licence.match(path.read_text())] == []


def too_long(source: str) -> list[str]:
    """Functions of more than a page, with their lines."""
    lines = [(node.name, (node.end_lineno or node.lineno) - node.lineno + 1)
             for node in ast.walk(ast.parse(source))
             if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    return [f'{name} ({count} lines)' for name, count in lines if count > MAX_FUNCTION_LINES]


def test_no_function_is_longer_than_a_page() -> None:
    long = {path: too_long(path.read_text()) for path in SOURCES}
    assert {path: functions for path, functions in long.items() if functions} == {}


def test_a_long_function_is_noticed() -> None:
    assert too_long('def f():\n' + MAX_FUNCTION_LINES * '    pass\n') == ['f (61 lines)']
