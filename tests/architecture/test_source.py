# SPDX-License-Identifier: Apache-2.0
"""Who may import whom (the tables in docs/architecture.md), read from the source."""

import ast
from collections.abc import Iterator
from functools import cache
import re
import subprocess
import sys

import pytest
from tests.places import ROOT

PRODUCT = ('leo_msgs_py', 'leo_sim', 'leo_diffmodel', 'leo_learner')
LABORATORY = 'leo_lab'
OURS = (*PRODUCT, LABORATORY)
"""Each may import those before it."""
HOMES = {
    **{package: ROOT / 'src' / package for package in PRODUCT},
    LABORATORY: ROOT / 'benchmarks/laboratory',
}
"""The folder that holds each package."""
MODULES = {
    '.'.join(path.relative_to(HOMES[package]).with_suffix('').parts).removesuffix(
        '.__init__'
    ): path
    for package in OURS
    for path in sorted((HOMES[package] / package).rglob('*.py'))
}
SOURCES = [
    path
    for pattern in ('src/**/*.py', 'tests/**/*.py', 'benchmarks/**/*.py')
    for path in sorted(ROOT.glob(pattern))
]
EXAMINERS = {LABORATORY, 'benchmarks', 'tests', *(p.stem for p in ROOT.glob('benchmarks/*.py'))}
"""What examines the product: the laboratory, the benchmarks' scripts, the tests."""
TRUTH = 'leo_sim.truth.hidden'
MAY_SEE_THE_TRUTH = {'leo_sim.drivers.simulated', 'leo_sim.verbs.reveal'}
ENGINES = {'pybullet': 'leo_sim.dynamics.pybullet', 'mujoco': 'leo_sim.references.mujoco'}
ROS = {
    'rclpy',
    'builtin_interfaces',
    'control_msgs',
    'diagnostic_msgs',
    'rcl_interfaces',
    'rosgraph_msgs',
    'sensor_msgs',
    'std_msgs',
    'std_srvs',
    'type_description_interfaces',
}
NEED_ROS = (
    'leo_msgs_py.hostile',
    'leo_msgs_py.node',
    'leo_msgs_py.serialized',
    'leo_msgs_py.topics',
    'leo_sim.nodes',
    'leo_diffmodel.bags.play',
    'leo_diffmodel.difference.service',
    'leo_diffmodel.nodes',
    'leo_learner.nodes',
    'leo_learner.robot_env',
    'leo_learner.robot_states',
    'leo_learner.running_robot',
)
"""What cannot be imported without ROS; everything else can."""
MAX_FUNCTION_LINES = 60
DRIVERS = 'leo_sim.drivers'
HARDWARE = (DRIVERS, 'leo_sim.description.servos', 'dynamixel_sdk', 'scservo_sdk')
ANY_DRIVER = tuple(f'{DRIVERS}.{name}' for name in ('base', 'safety', 'apart', 'check'))
"""What every driver has; what stands between it and a command; the suite that tries any."""
ONE_DRIVER = (
    DRIVERS,
    'leo_sim.description',
    'leo_sim.verbs.skeleton',
    'leo_sim.verbs.robot',
    'leo_sim.nodes.servo_bus',
)
"""What knows of servos: drivers, their bus, robot.yaml and what writes it."""
LOADERS = ('leo_sim.nodes.robot', 'leo_sim.verbs.check_driver')
"""What builds a driver by its name."""
BLIND = 'leo_lab.blind'
"""Makes its cases on the simulated driver, whatever runs elsewhere."""
KINDS = ('dynamixel', 'feetech', 'replay')
EXPLAIN = 'leo_diffmodel.explain'
EXPLAIN_ROOMS = (
    'settings',
    'problem',
    'estimate',
    'select',
    'unknown',
    'findings',
    'decide',
    'sentence',
    'rows',
    'explanation',
)
"""The rooms of explain; each may import those before it, late imports included."""
STAGES = (
    'bags',
    'outside',
    'compare',
    'exported',
    'faults',
    'explain',
    'check',
    'add',
    'difference',
    'next_run',
    'picture',
    'report',
    'watch',
    'nodes',
    'verbs',
)
"""The rooms of leo_diffmodel, likewise."""
PURE = ('decide', 'sentence', 'rows')
"""They read findings: nothing is fitted, settled or predicted there, nor where they import."""
FIT = tuple(
    f'{EXPLAIN}.{name}'
    for name in (
        'problem.pose',
        'problem.linearisation',
        'estimate.fit',
        'estimate.settle',
        'estimate.contact',
        'estimate.smooth',
        'estimate.finish',
        'select.sets',
        'select.search',
        'unknown',
        'findings.collect',
    )
)
PREDICT = (
    'leo_diffmodel.compare.pushes',
    'leo_diffmodel.compare.errors',
    f'{EXPLAIN}.problem.shooting',
    'leo_sim.model.batch',
    'leo_sim.model.rollout',
)


ROOMS = (
    'common',
    'description',
    'kinematics',
    'effects',
    'laws',
    'dynamics',
    'references',
    'model',
    'export',
    'task',
    'truth',
    'drivers',
    'nodes',
    'verbs',
)
"""The rooms of leo_sim, likewise."""


def imports(
    source: str, module: str, top_level_only: bool = False, types: bool = True
) -> Iterator[str]:
    """Yield every module `source` imports, as absolute names (`from a import b`: a and a.b).

    Args:
        source: of the module.
        module: its name.
        top_level_only: only what it imports when it is imported itself.
        types: also what it imports for annotations alone.
    """
    tree = ast.parse(source)
    is_package = module in MODULES and MODULES[module].name == '__init__.py'
    all_of_it = types and not top_level_only
    for node in ast.walk(tree) if all_of_it else _when_run(tree, not top_level_only):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parents = module.split('.')[: None if is_package and node.level == 1 else -node.level]
            base = '.'.join([*(parents if node.level else []), *filter(None, [node.module])])
            yield base
            yield from (f'{base}.{alias.name}' for alias in node.names)


def _when_run(node: ast.AST, late: bool) -> Iterator[ast.AST]:
    """Walk the statements that run when the module is imported; with `late` in functions, too."""
    for child in ast.iter_child_nodes(node):
        if not late and isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue
        if isinstance(child, ast.If) and 'TYPE_CHECKING' in ast.dump(child.test):
            continue
        yield child
        yield from _when_run(child, late)


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


def examiners(source: str) -> set[str]:
    """What a file of the product imports of that which examines it."""
    return {name for name in imports(source, '') if name.split('.')[0] in EXAMINERS}


def test_the_product_imports_nothing_that_examines_it() -> None:
    files = sorted(ROOT.glob('src/**/*.py'))
    found = {path: examiners(path.read_text()) for path in files}
    assert files and {path: names for path, names in found.items() if names} == {}
    named = [path for path in files if LABORATORY in path.read_text()]  # as an entry point
    assert named == []


@pytest.mark.parametrize(
    'source',
    [
        'from leo_lab.workers import Workers',
        'def f():\n    from benchmarks import rig',
        'import blind_tables',
        'if TYPE_CHECKING:\n    import leo_lab.blind.case',
    ],
)
def test_what_examines_is_noticed_where_the_product_imports_it(source: str) -> None:
    assert examiners(source)


@pytest.mark.parametrize(
    ('module', 'source'),
    [
        ('leo_msgs_py.topics', 'import leo_sim'),
        ('leo_learner.ddpg', 'from leo_lab.thesis import walking'),
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


def room(name: str, package: str) -> str:
    """The room of a dotted name in a package; '' outside it."""
    return name.removeprefix(f'{package}.').split('.')[0] if within(name, package) else ''


def later_rooms(module: str, source: str, package: str, rooms: tuple[str, ...]) -> set[str]:
    """What a module of a package imports from rooms after its own, anywhere in its source."""
    after = rooms[rooms.index(room(module, package)) + 1 :]
    return {name for name in imports(source, module) if room(name, package) in after}


def of_rooms(package: str, rooms: tuple[str, ...]) -> list[str]:
    """The modules in some rooms of a package."""
    return [m for m in MODULES if room(m, package) in rooms]


@pytest.mark.parametrize(
    ('package', 'rooms'), [('leo_sim', ROOMS), ('leo_diffmodel', STAGES), (EXPLAIN, EXPLAIN_ROOMS)]
)
def test_a_room_imports_only_those_before_it(package: str, rooms: tuple[str, ...]) -> None:
    files = of_rooms(package, rooms)
    found = {m: later_rooms(m, MODULES[m].read_text(), package, rooms) for m in files}
    assert {module: names for module, names in found.items() if names} == {}
    assert {room(m, package) for m in files} == set(rooms)


@pytest.mark.parametrize(
    ('package', 'rooms', 'module', 'source'),
    [
        ('leo_sim', ROOMS, 'leo_sim.laws.laws', 'from leo_sim.dynamics import ground'),
        ('leo_diffmodel', STAGES, f'{EXPLAIN}.problem.usable', 'import leo_diffmodel.check'),
        (EXPLAIN, EXPLAIN_ROOMS, f'{EXPLAIN}.problem.pose', f'import {EXPLAIN}.estimate.fit'),
    ],
)
def test_a_later_room_is_noticed(
    package: str, rooms: tuple[str, ...], module: str, source: str
) -> None:
    assert later_rooms(module, f'def f():\n    {source}', package, rooms)


def in_circles(sources: dict[str, str]) -> set[str]:
    """Modules that import each other in a circle, late and for types, too."""
    left = {m: sources.keys() & set(imports(text, m)) - {m} for m, text in sources.items()}
    while free := {m for m, loads in left.items() if not loads & left.keys()}:
        left = {m: loads for m, loads in left.items() if m not in free}
    return set(left)


@pytest.mark.parametrize('package', OURS)
def test_no_files_import_each_other_in_a_circle(package: str) -> None:
    files = {m: path.read_text() for m, path in MODULES.items() if within(m, package)}
    assert files and in_circles(files) == set()


@pytest.mark.parametrize(
    'late', ['def f():\n    import a.one', 'if TYPE_CHECKING:\n    from a.one import One']
)
def test_a_circle_is_noticed(late: str) -> None:
    assert in_circles({'a.one': 'from a import two', 'a.two': late}) == {'a.one', 'a.two'}


def run_by(module: str, source: str) -> set[str]:
    """The modules of explain that one of them imports to run, early or late."""
    return {n for n in imports(source, module, types=False) if n in MODULES and n != EXPLAIN}


def computing(module: str, source: str) -> set[str]:
    """What a module imports that predicts, and what it comes to, in turn, that fits."""
    reached, queue = set(), [*run_by(module, source)]
    while queue:
        name = queue.pop()
        if within(name, EXPLAIN) and name not in reached:
            reached.add(name)
            queue += run_by(name, MODULES[name].read_text())
    fits = {name for name in reached if any(within(name, known) for known in FIT)}
    return fits | {n for n in imports(source, module) if any(within(n, p) for p in PREDICT)}


def test_verdict_rows_and_sentences_are_read_off_findings() -> None:
    files = of_rooms(EXPLAIN, PURE)
    found = {m: computing(m, MODULES[m].read_text()) for m in files}
    assert files and {module: names for module, names in found.items() if names} == {}
    assert all(any(within(m, known) for m in MODULES) for known in FIT)


@pytest.mark.parametrize(
    'source',
    [
        f'from {EXPLAIN}.estimate.fit import fit',
        f'def f():\n    from {EXPLAIN}.findings.parts import without',
        f'from {EXPLAIN}.problem.shooting import predict',
        'from leo_sim.model import rollout',
        'def f():\n    from leo_diffmodel.compare.errors import predict_windows',
    ],
)
def test_a_fit_or_a_prediction_in_a_verdict_is_noticed(source: str) -> None:
    assert computing(f'{EXPLAIN}.decide', source)


def numbers(source: str) -> list[str]:
    """Names at the top of a module that hold numbers, or what the settings were at import."""
    made = [
        (node.targets if isinstance(node, ast.Assign) else [node.target], node.value)
        for node in ast.parse(source).body
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value
    ]
    return [
        ast.unparse(target)
        for targets, value in made
        if any(map(_is_number, ast.walk(value)))
        for target in targets
    ]


def _is_number(node: ast.AST) -> bool:
    named = node.attr if isinstance(node, ast.Attribute) else getattr(node, 'id', '')
    return named in ('SETTINGS', 'pi', 'e', 'inf', 'nan') or (
        isinstance(node, ast.Constant) and type(node.value) in (int, float)
    )


def test_all_numbers_of_explain_are_settings_that_travel_with_the_problem() -> None:
    """Nor is a default anything but at the two doors, where a problem is posed."""
    rooms = of_rooms(EXPLAIN, tuple(r for r in EXPLAIN_ROOMS if r != 'settings'))
    sources = {module: MODULES[module].read_text() for module in rooms}
    found = {module: numbers(source) for module, source in sources.items()}
    assert {module: names for module, names in found.items() if names} == {}
    defaults = {f'{EXPLAIN}.settings.{name}' for name in ('SETTINGS', 'settings_for')}
    doors = {
        module
        for module, source in sources.items()
        if defaults.intersection(imports(source, module))
    }
    assert doors == {f'{EXPLAIN}.explanation', f'{EXPLAIN}.problem.pose'}


@pytest.mark.parametrize(
    'source',
    [
        'HUBER = 2.5',
        'MOST, SCALES = 4, (1.0, 0.3)',
        'RIDGE: float = -1e-9',
        'TURN = np.pi',
        'NEARBY = np.linspace(-1.0, 1.0, 33)',
        'MARGIN = SETTINGS.gates.margin_nats',
        "WIDTHS = {'narrow': 0.1}",
        'STILL = Motor(0.0, 0.0)',
    ],
)
def test_a_number_at_the_top_of_a_module_is_noticed(source: str) -> None:
    assert numbers(source)


@pytest.mark.parametrize(
    'source',
    [
        "NAMES = ('q', 'dq')",
        'Array = np.ndarray',
        'def f():\n    most = 3',
        'TRUE = True',
        '_started: list[Future] = []',
    ],
)
def test_texts_and_types_are_no_numbers(source: str) -> None:
    assert numbers(source) == []


def test_every_number_of_explain_is_read() -> None:
    texts = ''.join(MODULES[m].read_text() for m in of_rooms('leo_diffmodel', ('explain',)))
    read = set(re.findall(r'\.(\w+)', texts))
    tables = [MODULES[f'{EXPLAIN}.settings.{part}'] for part in ('gates', 'numerics', 'grids')]
    kept = [
        ast.unparse(n.target)
        for path in tables
        for n in ast.walk(ast.parse(path.read_text()))
        if isinstance(n, ast.AnnAssign)
    ]
    assert len(kept) > 100 and [name for name in kept if name not in read] == []


def of_one_driver(module: str, source: str) -> list[str]:
    """Name what a module knows of which driver runs: imports, and drivers' names as texts."""
    loads = [DRIVERS, f'{DRIVERS}.load_driver'] if module in LOADERS else []
    found = [
        name
        for name in imports(source, module)
        if any(within(name, place) for place in HARDWARE)
        and not any(within(name, place) for place in ANY_DRIVER)
        and name not in loads
    ]
    texts = [
        node.value
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Constant) and node.value in KINDS
    ]
    return [*found, *texts]


def test_nobody_but_drivers_knows_which_driver_runs() -> None:
    """Learner, recorder, play, Algorithm 5 and all verbs are the same with every driver."""
    others = [m for m in MODULES if not any(within(m, p) for p in (*ONE_DRIVER, BLIND))]
    known = {module: of_one_driver(module, MODULES[module].read_text()) for module in others}
    assert {module: names for module, names in known.items() if names} == {}


@pytest.mark.parametrize(
    'source',
    [
        "if driver == 'dynamixel':\n    pass",
        'from leo_sim.drivers.dynamixel import DynamixelDriver',
        'from leo_sim.drivers import load_driver',
        'import scservo_sdk',
    ],
)
def test_a_branch_on_the_driver_is_noticed(source: str) -> None:
    assert of_one_driver('leo_learner.learning', source)


def test_torch_is_noticed_where_it_is_loaded() -> None:
    assert 'torch' in reached_from('leo_learner.ddpg')


def test_files_start_with_their_licence() -> None:
    licence = re.compile(r'(#!.*\n)?# SPDX-License-Identifier: Apache-2\.0\n')
    assert [path for path in SOURCES if not licence.match(path.read_text())] == []


def too_long(source: str) -> list[str]:
    """Functions of more than a page, with their lines."""
    lines = [
        (node.name, (node.end_lineno or node.lineno) - node.lineno + 1)
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]
    return [f'{name} ({count} lines)' for name, count in lines if count > MAX_FUNCTION_LINES]


def test_no_function_is_longer_than_a_page() -> None:
    long = {path: too_long(path.read_text()) for path in SOURCES}
    assert {path: functions for path, functions in long.items() if functions} == {}


def test_a_long_function_is_noticed() -> None:
    assert too_long('def f():\n' + MAX_FUNCTION_LINES * '    pass\n') == ['f (61 lines)']
