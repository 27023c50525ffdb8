# SPDX-License-Identifier: Apache-2.0
"""Which two effects explain most together, by the linear answer of what was scanned."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leo_diffmodel.explain.estimate.scan import Scan, stretch_limits
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.settings import Numerics, Settings

Array = np.ndarray
Point = tuple[tuple[Candidate, ...], Array]


def best_pairs(
    scans: Sequence[Scan], residual: Array, most: int, least: float, settings: Settings
) -> list[Point]:
    """The pairs that save most, each with the values at which it does.

    Args:
        scans: of the candidates.
        residual: what the signatures of the scans are to explain, shape (M,).
        most: how many pairs.
        least: by how many nats a pair must be better than the better of its two.
        settings: how many points of each take part, which are too much alike, how far they reach.
    """
    numerics = settings.numerics
    owner, rows, lengths = _atoms(scans, residual, numerics.pair_points)
    if len(owner) < 2:
        return []
    along, cosine = rows @ residual, rows @ rows.T
    saved, first = _saved(along, cosine, lengths, [scans[o] for o in owner], settings)
    alone = 0.5 * np.maximum(along, 0.0) ** 2
    best = np.zeros(len(scans))
    np.maximum.at(best, owner, alone)
    both = np.maximum(best[owner][:, None], best[owner][None, :])
    saved = np.where(saved > both + least, saved, -np.inf)
    found: dict[frozenset[int], Point] = {}
    for flat in np.argsort(-saved, axis=None)[: numerics.pair_looks * most]:
        i, j = np.unravel_index(flat, saved.shape)
        if not np.isfinite(saved[i, j]) or len(found) == most:
            break
        key = frozenset((int(owner[i]), int(owner[j])))
        if len(key) == 2 and key not in found:
            found[key] = _point(scans, owner, lengths, (i, j), (first[i, j], first[j, i]))
    return list(found.values())


def leading(scans: Sequence[Scan], residual: Array, numerics: Numerics) -> list[Scan]:
    """The first scans of as many different answers: of those that do the same thing, one.

    Args:
        scans: of the candidates, best first.
        residual: what their signatures are to explain, shape (M,).
        numerics: how many, and which do the same thing.
    """
    kept: list[Scan] = []
    rows = np.zeros((0, len(residual)))
    for scan in scans:
        row = scan.signatures[int(np.argmax(scan.signatures @ residual))]
        if len(kept) < numerics.leaders and (np.abs(rows @ row) < numerics.parallel).all():
            kept.append(scan)
            rows = np.vstack([rows, row])
    return kept


def _atoms(scans: Sequence[Scan], residual: Array, most: int) -> tuple[Array, Array, Array]:
    """The points that explain most of each candidate: owner, unit signature, length."""
    owner, rows, lengths = [], [], []
    for number, scan in enumerate(scans):
        along = np.maximum(scan.signatures @ residual, 0.0)
        for k in np.argsort(-along)[:most]:
            if scan.nats[k] > 0.5:
                owner.append((number, k))
                rows.append(scan.signatures[k])
                lengths.append(np.sqrt(2 * scan.nats[k]))
    index = np.array([o for o, _ in owner], dtype=int)
    return index, np.array(rows), np.array([*zip(lengths, (k for _, k in owner), strict=True)])


def _saved(
    along: Array, cosine: Array, lengths: Array, scans: Sequence[Scan], settings: Settings
) -> tuple[Array, Array]:
    """Nats that atoms i and j save together, and the stretch of i then; -inf where impossible."""
    free = np.where(np.abs(cosine) < settings.numerics.parallel, 1 - cosine**2, np.inf)
    share = (along[:, None] - cosine * along[None, :]) / free
    stretch = share / lengths[:, :1]
    limits = np.array([stretch_limits(s.candidate, settings.grids) for s in scans])
    able = (stretch >= 0.5 * limits[:, :1]) & (stretch <= 2 * limits[:, 1:])
    saved = 0.5 * (share * along[:, None] + share.T * along[None, :])
    return np.where(able & able.T, saved, -np.inf), np.clip(stretch, limits[:, :1], limits[:, 1:])


def _point(
    scans: Sequence[Scan], owner: Array, lengths: Array, pair: tuple, stretch: tuple
) -> Point:
    taken = [scans[owner[i]] for i in pair]
    values = [
        s.stretched(int(lengths[i, 1]), float(by))
        for s, i, by in zip(taken, pair, stretch, strict=True)
    ]
    return tuple(s.candidate for s in taken), np.concatenate(values)
