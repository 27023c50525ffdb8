# SPDX-License-Identifier: Apache-2.0
"""Commands that are printed for people to type."""

import shlex


def leo(*words: object) -> str:
    """A `leo` command as a shell takes it: each word quoted where it must be."""
    return shlex.join(['leo', *map(str, words)])
