# SPDX-License-Identifier: Apache-2.0
"""The one exception for input a user can put right."""


class UserError(Exception):
    """Bad input: one sentence saying what, where and what to do.

    The `leo` command prints it as a single line on stderr and exits with status 2.
    """
