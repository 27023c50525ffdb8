# SPDX-License-Identifier: Apache-2.0
"""Bags, compare, explain, add, the difference model and its node.

From Python: `from leo_diffmodel import read_bag, compare, explain, add` (docs/python.md). The
functions have the names of the packages they come from; `leo_diffmodel.explain` is the function,
and `from leo_diffmodel.explain.settings import SETTINGS` still finds the package's modules.
"""

# Loaded before the functions of their names, which a later import of a package would replace.
import leo_diffmodel.add
import leo_diffmodel.compare
import leo_diffmodel.explain  # noqa: F401

from leo_diffmodel.api import add, compare, explain, read_bag  # isort: skip

__all__ = ['add', 'compare', 'explain', 'read_bag']
