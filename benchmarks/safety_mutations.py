# SPDX-License-Identifier: Apache-2.0
"""Takes one safety measure out at a time: at least one test must fail for each.

    python benchmarks/safety_mutations.py [NAME ...]

The measures are in safety_mutations.yaml; each change is made in a copy of the source, which the
tests here then run against.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
from tempfile import TemporaryDirectory

import yaml

ROOT = Path(__file__).parents[1]
PACKAGE = 'src/leo_sim/leo_sim'
MUTATIONS: dict[str, dict[str, str]] = yaml.safe_load(
    Path(__file__).with_suffix('.yaml').read_text()
)


def main() -> int:
    """Run and print; 1 if a measure can be taken out unnoticed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('names', nargs='*', help=', '.join(MUTATIONS))
    names = parser.parse_args().names or list(MUTATIONS)
    missed = [name for name in names if not noticed(name, MUTATIONS[name])]
    print(f'{len(names) - len(missed)} of {len(names)} are noticed')
    return int(bool(missed))


def noticed(name: str, mutation: dict[str, str]) -> bool:
    """Whether a test fails without a measure."""
    with TemporaryDirectory() as folder:
        source = Path(folder) / 'src'
        shutil.copytree(ROOT / 'src', source, ignore=shutil.ignore_patterns('*.pyc'))
        file = Path(folder, PACKAGE, mutation['file'])
        text = file.read_text()
        assert text.count(mutation['old']) == 1, f'{name}: {file.name} has changed'
        file.write_text(text.replace(mutation['old'], mutation.get('new', '')))
        paths = os.pathsep.join(str(package) for package in sorted(source.iterdir()))
        run = subprocess.run(
            [
                sys.executable,
                '-m',
                'pytest',
                '-q',
                '-x',
                '-p',
                'no:cacheprovider',
                *f'tests/{mutation["tests"]}'.split(),
            ],
            cwd=ROOT,
            env={**os.environ, 'PYTHONPATH': paths},
            capture_output=True,
            text=True,
        )
    failed = re.findall(r'^(?:FAILED|ERROR) \S+::(\S+)', run.stdout, re.MULTILINE)
    print(f'{name:37}{failed[0] if failed else "NOT NOTICED"}', flush=True)
    return bool(failed)


if __name__ == '__main__':
    sys.exit(main())
