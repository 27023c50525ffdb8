# SPDX-License-Identifier: Apache-2.0
"""The one exception for input a user can put right."""

from leo_msgs_py.terminal import visible

LONGEST = 120  # of what a library says, within a message


class UserError(Exception):
    """Bad input: one sentence saying what, where and what to do.

    The `leo` command prints it as a single line on stderr and exits with status 2. Control codes
    in it, of names from files and messages, are spelt out.
    """

    def __init__(self, message: str) -> None:
        super().__init__(visible(message))


def one_line(error: Exception) -> str:
    """What a library says is wrong, as part of a `UserError`: its first line, not too long."""
    said = error.msg if isinstance(error, SyntaxError) else str(error)
    line = (said or type(error).__name__).splitlines()[0]
    return line if len(line) <= LONGEST else f'{line[:LONGEST].rsplit(" ", 1)[0]} …'
