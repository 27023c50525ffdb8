# SPDX-License-Identifier: Apache-2.0
"""The source as the tests of architecture read it."""

import ast
from collections.abc import Iterator

from tests.places import ROOT

PRODUCT = ('leo_msgs_py', 'leo_sim', 'leo_diffmodel', 'leo_learner')
LABORATORY = 'leo_lab'
HOMES = {
    **{package: ROOT / 'src' / package for package in PRODUCT},
    LABORATORY: ROOT / 'benchmarks/laboratory',
}
"""The folder that holds each package."""
MODULES = {
    '.'.join(path.relative_to(HOMES[package]).with_suffix('').parts).removesuffix(
        '.__init__'
    ): path
    for package in HOMES
    for path in sorted((HOMES[package] / package).rglob('*.py'))
}


def imports(source: str, module: str = '') -> Iterator[str]:
    """Yield every module `source` imports, as absolute names (`from a import b`: a and a.b)."""
    is_package = module in MODULES and MODULES[module].name == '__init__.py'
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parents = module.split('.')[: None if is_package and node.level == 1 else -node.level]
            base = '.'.join([*(parents if node.level else []), *filter(None, [node.module])])
            yield base
            yield from (f'{base}.{alias.name}' for alias in node.names)


def within(name: str, package: str) -> bool:
    """Tell whether dotted `name` is `package` or lies in it."""
    return name == package or name.startswith(f'{package}.')


def room(name: str, package: str) -> str:
    """The room of a dotted name in a package; '' outside it."""
    return name.removeprefix(f'{package}.').split('.')[0] if within(name, package) else ''


def of_rooms(package: str, rooms: tuple[str, ...]) -> list[str]:
    """The modules in some rooms of a package."""
    return [m for m in MODULES if room(m, package) in rooms]
