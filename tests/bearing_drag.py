# SPDX-License-Identifier: Apache-2.0
"""The README's own example effect."""

from tests.places import ROOT

_BLOCKS = (ROOT / 'README.md').read_text().split('```python\n')
(BEARING_DRAG,) = (block.split('```')[0] for block in _BLOCKS if 'class BearingDrag' in block)
