# SPDX-License-Identifier: Apache-2.0
"""Both installs of the workspace, colcon's and pip's, hold what ros2 run and leo run look for."""

from importlib.metadata import distribution, distributions, entry_points
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
from threading import Timer
import tomllib
import xml.etree.ElementTree as ElementTree

from packaging.requirements import Requirement
import pytest
from tests.places import ROOT

PACKAGES = ('leo_msgs_py', 'leo_sim', 'leo_diffmodel', 'leo_learner')
LABORATORY = ROOT / 'benchmarks/laboratory'
EXECUTABLES = (
    ('leo_sim', 'robot'),
    ('leo_sim', 'servo_bus'),
    ('leo_diffmodel', 'diffmodel'),
    ('leo_learner', 'learner'),
)


@pytest.fixture(scope='session')
def colcon_install(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the workspace with colcon, outside the tree, and return its install folder."""
    base = tmp_path_factory.mktemp('colcon')
    command = [
        *(sys.executable, '-m', 'colcon', '--log-base', 'log', 'build'),
        *('--base-paths', str(ROOT / 'src'), '--build-base', 'build', '--install-base', 'install'),
    ]
    done = subprocess.run(command, cwd=base, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stdout + done.stderr
    assert '4 packages finished' in done.stdout + done.stderr
    return base / 'install'


def sourced(install: Path, command: str, folder: Path) -> subprocess.Popen[str]:
    """Start a shell command as a user does who has sourced the workspace, this Python first."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ['PATH']])
    return subprocess.Popen(
        ['bash', '-c', f'. {install}/local_setup.bash && {command}'],
        env={**os.environ, 'PATH': path},
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


@pytest.mark.parametrize('package', PACKAGES)
def test_colcon_and_pip_install_what_ros_reads_and_nodes_where_ros2_run_looks(
    colcon_install: Path, pip_prefix: Path, package: str
) -> None:
    for prefix in (colcon_install / package, pip_prefix):
        share = prefix / 'share'
        assert (share / 'ament_index' / 'resource_index' / 'packages' / package).is_file()
        assert (share / package / 'package.xml').is_file()
        for files in ('launch/*.launch.py', 'config/*.yaml'):
            source = {p.name for p in (ROOT / 'src' / package).glob(files)}
            assert {p.name for p in (share / package).glob(files)} == source
            assert source or package == 'leo_msgs_py'
        nodes = {p.name for p in (prefix / 'lib' / package).glob('*') if os.access(p, os.X_OK)}
        assert nodes == {node for owner, node in EXECUTABLES if owner == package}
    assert package == 'leo_msgs_py' or not (colcon_install / package / 'bin').exists()


def test_colcon_puts_leo_on_the_path(colcon_install: Path, tmp_path: Path) -> None:
    with sourced(colcon_install, 'command -v leo && leo --help', tmp_path) as process:
        output, _ = process.communicate(timeout=300)
    assert process.returncode == 0, output
    assert str(colcon_install / 'leo_msgs_py' / 'bin' / 'leo') in output


@pytest.mark.graph
@pytest.mark.usefixtures('domain')
@pytest.mark.parametrize(('package', 'executable'), EXECUTABLES)
def test_installed_node_starts_and_stops(
    colcon_install: Path, tmp_path: Path, package: str, executable: str
) -> None:
    node = colcon_install / package / 'lib' / package / executable
    untrained = '--ros-args -p first_steps:=0' if executable == 'learner' else ''
    with sourced(colcon_install, f'exec {node} {untrained}', tmp_path) as process:
        patience = Timer(300.0, process.kill)
        patience.start()
        assert process.stdout is not None
        first_line = process.stdout.readline()
        process.send_signal(signal.SIGINT)
        rest, _ = process.communicate()
        patience.cancel()
    assert 'ROS_DOMAIN_ID' in first_line and 'reach LOCALHOST' in first_line
    assert process.returncode == 0, first_line + rest
    assert 'Traceback' not in rest


@pytest.mark.parametrize('package', PACKAGES)
def test_colcon_installs_every_module_and_data_file(colcon_install: Path, package: str) -> None:
    [installed] = colcon_install.glob(f'{package}/lib/python*/site-packages/{package}')
    source = ROOT / 'src' / package / package
    files = [p.relative_to(source) for p in source.rglob('*') if p.is_file()]
    sources = [f for f in files if not f.parts[0].startswith('.') and '__pycache__' not in f.parts]
    assert [str(f) for f in sources if not (installed / f).exists()] == []


@pytest.fixture(scope='session')
def pip_prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return installed(tmp_path_factory.mktemp('pip'), ROOT / 'src', PACKAGES)


@pytest.fixture(scope='session')
def laboratory_prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return installed(tmp_path_factory.mktemp('laboratory'), LABORATORY, ('.',))


def installed(base: Path, source: Path, packages: tuple[str, ...]) -> Path:
    """Install the packages in a folder with pip, each by itself, and return where."""
    shutil.copytree(  # pip builds in the source's own folder
        source, base / 'source', ignore=shutil.ignore_patterns('build', '*.egg-info')
    )
    command = [
        *(sys.executable, '-m', 'pip', 'install', '--quiet', '--no-deps', '--no-index'),
        *('--no-build-isolation', '--ignore-installed', '--prefix', str(base / 'prefix')),
        *(str(base / 'source' / package) for package in packages),
    ]
    done = subprocess.run(command, cwd=base, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    return base / 'prefix'


def modules(prefix: Path) -> Path:
    [folder] = prefix.glob('lib/python*/site-packages')
    return folder


def verbs(prefix: Path) -> set[str]:
    known = distributions(path=[str(modules(prefix))])
    return {e.name for found in known for e in found.entry_points if e.group == 'leo.verbs'}


def test_pip_installs_leo_and_no_node_into_bin(pip_prefix: Path) -> None:
    assert {p.name for p in (pip_prefix / 'bin').glob('*')} == {'leo'}
    scripts = {p.name for p in Path(sys.executable).parent.iterdir()}
    assert 'leo' in scripts
    assert scripts.isdisjoint(node for _, node in EXECUTABLES)


def test_pip_of_the_four_packages_leaves_the_laboratory_out(
    pip_prefix: Path, laboratory_prefix: Path
) -> None:
    there = (p for p in modules(pip_prefix).iterdir() if not p.suffix.endswith('-info'))
    assert {p.name for p in there} == set(PACKAGES)
    assert verbs(laboratory_prefix) == {'blind', 'reproduce', 'seeds'}
    assert verbs(pip_prefix) and verbs(pip_prefix).isdisjoint(verbs(laboratory_prefix))


def test_pip_installs_every_module_of_the_laboratory_and_no_command(
    laboratory_prefix: Path,
) -> None:
    source, there = LABORATORY / 'leo_lab', modules(laboratory_prefix) / 'leo_lab'
    files = [*source.rglob('*.py'), source / 'py.typed']
    assert [p for p in files if not (there / p.relative_to(source)).exists()] == []
    assert not (laboratory_prefix / 'bin').exists()


def test_the_laboratory_names_all_that_it_imports_of_ours() -> None:
    described = tomllib.loads((LABORATORY / 'pyproject.toml').read_text())['project']
    assert set(PACKAGES) <= set(described['dependencies'])
    assert distribution(described['name']).version == described['version']


def test_every_node_is_known_to_leo_run() -> None:
    known = {e.name for e in entry_points(group='leo.executables')}
    assert {f'{package}.{node}' for package, node in EXECUTABLES} <= known


@pytest.mark.parametrize('group', sorted(g for g in entry_points().groups if g.startswith('leo.')))
def test_every_entry_point_leads_somewhere(group: str) -> None:
    ours = (*PACKAGES, 'leo_lab')
    found = [e for e in entry_points(group=group) if e.dist and e.dist.name in ours]
    loaded = {e.name: e.load() for e in found}
    assert None not in loaded.values()
    if group in ('leo.verbs', 'leo.executables'):
        assert loaded
        assert [name for name, target in loaded.items() if not callable(target)] == []


@pytest.mark.parametrize('package', PACKAGES)
def test_the_two_manifests_agree(pip_prefix: Path, package: str) -> None:
    manifest = ElementTree.parse(ROOT / 'src' / package / 'package.xml').getroot()
    [found] = distributions(name=package, path=[str(modules(pip_prefix))])
    installed = found.metadata
    assert manifest.get('format') == '3'
    assert manifest.findtext('export/build_type') == 'ament_python'
    assert manifest.findtext('version') == installed['Version']
    assert manifest.findtext('license') == installed['License-Expression']
    ours = {d.text for d in manifest.findall('exec_depend')} & set(PACKAGES)
    required = {Requirement(r).name for r in found.requires or ()}
    assert ours == required & set(PACKAGES)
