# SPDX-License-Identifier: Apache-2.0
"""Every file says its licence."""

import re

from tests.places import ROOT

LICENCE = re.compile(r'(#!.*\n)?# SPDX-License-Identifier: Apache-2\.0\n')


def test_files_start_with_their_licence() -> None:
    tops = ('src', 'tests', 'benchmarks')
    files = [path for top in tops for path in ROOT.glob(f'{top}/**/*.py')]
    assert len(files) > 100
    assert [path for path in files if not LICENCE.match(path.read_text())] == []
