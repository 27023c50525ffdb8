# SPDX-License-Identifier: Apache-2.0
"""Changes the source for the worse, one change at a time: at least one test must fail for each.

    python benchmarks/mutations.py safety [NAME ...]     without a measure for safety
    python benchmarks/mutations.py explain [NAME ...]    with an answer that decides otherwise

The changes are in safety_mutations.yaml and explain_mutations.yaml; each is made in a copy of the
source, which the tests here then run against.
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
Mutation = dict[str, str]


def main() -> int:
    """Run and print; 1 if a change goes unnoticed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('of', choices=('safety', 'explain'))
    parser.add_argument('names', nargs='*', help='of the changes; all where none is given')
    options = parser.parse_args()
    listed = Path(__file__).with_name(f'{options.of}_mutations.yaml').read_text()
    mutations: dict[str, Mutation] = yaml.safe_load(listed)
    names = options.names or list(mutations)
    missed = [name for name in names if not noticed(name, mutations[name])]
    print(f'{len(names) - len(missed)} of {len(names)} are noticed')
    return int(bool(missed))


def noticed(name: str, mutation: Mutation) -> bool:
    """Whether a test fails with a change."""
    with TemporaryDirectory() as folder:
        source = Path(folder) / 'src'
        shutil.copytree(ROOT / 'src', source, ignore=shutil.ignore_patterns('*.pyc'))
        file = Path(source, mutation['file'])
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
