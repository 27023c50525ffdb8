# SPDX-License-Identifier: Apache-2.0
"""Which seeds an examination may use."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from leo_lab.origin import commit
from leo_msgs_py.errors import UserError

FIRST_OF_EXAMINATION = 50_000
"""Smaller seeds are for development, these and larger ones for examinations."""


def check_seeds(
    kind: str, seeds: Sequence[int], held: Iterable[Mapping], examination: bool
) -> None:
    """Refuse a seed on the wrong side, or one that was examined before, by other code.

    What this code examined is not run again, so an examination that was cut off goes on.

    Args:
        kind: of the cases.
        seeds: that are asked for.
        held: lines of the results file.
        examination: whether this is one.

    Raises:
        UserError: one line that says which seed and why.
    """
    if not examination:
        if seeds and max(seeds) >= FIRST_OF_EXAMINATION:
            raise UserError(
                f'leo blind: seed {max(seeds)} is for an examination of {kind}; '
                f'take seeds below {FIRST_OF_EXAMINATION}, or --examination'
            )
        return
    if seeds and min(seeds) < FIRST_OF_EXAMINATION:
        raise UserError(
            f'leo blind: seed {min(seeds)} is for development; an examination '
            f'takes seeds from {FIRST_OF_EXAMINATION} on'
        )
    own = (True, commit())
    before = (x for x in held if x['kind'] == kind and (x['examination'], x['commit']) != own)
    seen = {line['seed'] for line in before} & set(seeds)
    if seen:
        raise UserError(
            f'leo blind: seed {min(seen)} of {kind} is in the results already; '
            'no seed is examined twice'
        )
