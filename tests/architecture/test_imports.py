# SPDX-License-Identifier: Apache-2.0
"""Who may import whom: the contracts of import-linter in pyproject.toml; what is loaded when."""

from pathlib import Path
import subprocess
import sys
import tomllib

import pytest
from tests.architecture.source import HOMES, imports, LABORATORY, MODULES, within
from tests.places import ROOT

from leo_msgs_py import cli

ROS = {*cli._ROS, 'control_msgs', 'type_description_interfaces'}
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
    'leo_learner.robot',
)
"""What cannot be imported without ROS; everything else can."""

SLOW = 'bokeh matplotlib mcap numba numpy pandas pyarrow pydantic rclpy rosbags scipy torch'


def run(*words: str) -> subprocess.CompletedProcess[str]:
    """Run a program of this environment in the project's folder."""
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=300)


def python(code: str) -> None:
    done = run(sys.executable, '-c', f'import sys\n{code}')
    assert done.returncode == 0, done.stderr


def test_imports_are_allowed() -> None:
    done = run(str(Path(sys.executable).with_name('lint-imports')), '--no-cache')
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_product_does_not_know_what_examines_it() -> None:
    files = sorted(ROOT.glob('src/**/*.py'))
    assert files and [path for path in files if LABORATORY in path.read_text()] == []


def test_ros_is_loaded_only_by_what_needs_it() -> None:
    without = [m for m in MODULES if not any(within(m, known) for known in NEED_ROS)]
    python(
        'import importlib\n'
        f'for module in {without}:\n'
        '    importlib.import_module(module)\n'
        f'    assert not {ROS} & sys.modules.keys(), module\n'
    )


@pytest.mark.parametrize('known', NEED_ROS)
def test_what_needs_ros_is_still_there(known: str) -> None:
    modules = [m for m in MODULES if within(m, known)]
    loaded = {name for m in modules for name in imports(MODULES[m].read_text(), m)}
    assert {name.split('.')[0] for name in loaded} & ROS or loaded & {*NEED_ROS}


def test_the_help_of_leo_and_of_its_verbs_loads_nothing_slow() -> None:
    python(
        'from importlib.metadata import entry_points\n'
        'from leo_msgs_py.cli import main\n'
        f'main(["--help"])\nslow = {SLOW!r}.split()\n'
        "assert not {*slow, 'rich', 'yaml'} & sys.modules.keys(), 'leo'\n"
        "for entry in entry_points(group='leo.verbs'):\n"
        "    try: ended = entry.load()(['--help'])\n"
        '    except SystemExit as error: ended = error.code\n'
        "    assert not ended, f'no help: {entry}'\n"
        '    assert not {*slow} & sys.modules.keys(), entry\n'
    )


def test_python_offers_the_commands_as_functions_without_torch() -> None:
    python(
        'from leo_diffmodel.explain.settings import SETTINGS\n'
        'from leo_diffmodel import add, compare, explain, read_bag\n'
        'assert all(map(callable, (add, compare, explain, read_bag)))\n'
        "assert not {'torch', 'rclpy', 'numba'} & sys.modules.keys()\n"
    )


def test_the_contracts_are_of_all_packages() -> None:
    linter = tomllib.loads((ROOT / 'pyproject.toml').read_text())['tool']['importlinter']
    assert linter['root_packages'] == [*HOMES]
