# SPDX-License-Identifier: Apache-2.0
"""Least squares of a missing torque, judged on the folds that are left out of it."""

from typing import NamedTuple

import numpy as np

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.unknown.influence import Influence


class Score(NamedTuple):
    """What a linear law is worth; every field has one entry for each of the F laws tried."""

    values: Array  # coefficients, shape (F, B)
    spread: Array  # their standard deviation, shape (F, B)
    fitted: Array  # gain in each fold, fitted to all [nats], shape (F, folds)
    left_out: Array  # in each, predicted from the others [nats], shape (F, folds)
    others: Array  # in these others, to which it was then fitted [nats], shape (F, folds)

    @property
    def gain_train(self) -> Array:
        """In all folds, fitted to them [nats], shape (F,)."""
        return np.asarray(self.fitted.sum(axis=-1))

    @property
    def gain(self) -> Array:
        """In all folds, each predicted from the others [nats], shape (F,)."""
        return np.asarray(self.left_out.sum(axis=-1))

    @property
    def best_gain(self) -> float:
        """In all folds, the law and its coefficients chosen by the other folds [nats]."""
        best = np.argmax(self.others, axis=0)
        return float(self.left_out[best, np.arange(len(best))].sum())

    def at(self, index: int) -> 'Score':
        return Score(*(field[index] for field in self))


class _Normal(NamedTuple):
    """Sums over windows: normal matrices (..., F, B, B), right sides (..., F, B)."""

    matrix: Array
    slope: Array

    def solved(self, ridge: float) -> Array:
        return np.linalg.solve(_ridged(self.matrix, ridge), self.slope[..., None])[..., 0]

    def nats(self, found: Array) -> Array:
        """Nats gained here by coefficients found anywhere; a law beyond all numbers gains none."""
        with np.errstate(all='ignore'):
            changed = np.einsum('...fi,...fij,...fj->...f', found, self.matrix, found)
            gained = np.einsum('...fi,...fi->...f', found, self.slope) - 0.5 * changed
        return np.where(np.isfinite(gained), gained, -np.inf)


class Regression:
    """Regression of one joint's missing torque; the fit's own parameters move along.

    What the fit's parameters can do is taken out of the residual and of every law, by their
    response over all training windows.
    """

    def __init__(self, left: Influence, joint: int) -> None:
        """Sum up what the windows say of a torque at the joint of this index."""
        self.left, self.joint = left, joint
        fold, train = left.problem.fold, left.problem.train
        assert fold is not None
        self._train, self._ridge = train, left.problem.numerics.ridge
        columns = np.concatenate([left.answer[..., joint], left.by_theta], axis=-1)
        turned = np.swapaxes(columns, -1, -2)
        self._matrix, self._slope = turned @ columns, (turned @ left.residual[..., None])[..., 0]
        self._stretches = left.answer.shape[-2]
        self._folds = [np.flatnonzero((fold == f) & train) for f in np.unique(fold[train])]

    def of(self, torque: Array) -> Score:
        """Fit laws that are linear in their coefficients.

        Args:
            torque: per unit of each coefficient in each stretch, shape (W, G, F, B).
        """
        flat = torque.reshape(*torque.shape[:2], -1)
        answered = np.swapaxes(self._matrix[:, : self._stretches], -1, -2) @ flat
        answered = answered.reshape(len(flat), -1, *torque.shape[2:])
        own = self._responses(answered)
        sums = [self._sum(torque, answered, own, fold) for fold in self._folds]
        parts = _Normal(*map(np.stack, zip(*sums, strict=True)))
        whole = _Normal(parts.matrix.sum(axis=0), parts.slope.sum(axis=0))
        rests = _Normal(whole.matrix - parts.matrix, whole.slope - parts.slope)
        found, without = whole.solved(self._ridge), rests.solved(self._ridge)
        inverse = np.linalg.inv(_ridged(whole.matrix, self._ridge))
        spread = np.sqrt(np.maximum(np.diagonal(inverse, axis1=-2, axis2=-1), 0.0))
        gains = parts.nats(found), parts.nats(without), rests.nats(without)
        return Score(found, spread, *(np.ascontiguousarray(gain.T) for gain in gains))

    def _responses(self, answered: Array) -> tuple[Array, Array]:
        """What the fit's parameters do about the laws (F, P, B) and about the residual (P,)."""
        count = self._stretches
        matrix = self._matrix[self._train, count:, count:].sum(axis=0)
        cross = answered[self._train, count:].sum(axis=0).swapaxes(0, 1)
        slope = self._slope[self._train, count:].sum(axis=0)
        inverse = np.linalg.inv(_ridged(matrix, self._ridge)) if len(matrix) else matrix
        return inverse @ cross, inverse @ slope

    def _sum(self, torque: Array, answered: Array, own: tuple[Array, ...], fold: Array) -> _Normal:
        """Normal equations of the coefficients on fold windows, the parameters taken out."""
        count = self._stretches
        part, answer = torque[fold], answered[fold]
        cross = answer[:, count:].sum(axis=0).swapaxes(0, 1)
        matrix = np.einsum('wgfb,wgfc->fbc', part, answer[:, :count])
        slope = np.einsum('wgfb,wg->fb', part, self._slope[fold, :count])
        by_law, by_rest = own
        inner = self._matrix[fold, count:, count:].sum(axis=0)
        moved = np.swapaxes(by_law, -1, -2)
        mixed = np.swapaxes(cross, -1, -2) @ by_law
        matrix = matrix - mixed - np.swapaxes(mixed, -1, -2) + moved @ inner @ by_law
        rest = self._slope[fold, count:].sum(axis=0) - inner @ by_rest
        slope = slope - np.swapaxes(cross, -1, -2) @ by_rest - moved @ rest
        return _Normal(matrix, slope)


def _ridged(matrix: Array, ridge: float) -> Array:
    diagonal = np.diagonal(matrix, axis1=-2, axis2=-1)
    floor = np.maximum(diagonal, 1e-12 * diagonal.max(axis=-1, keepdims=True) + 1e-300)
    return matrix + ridge * floor[..., None] * np.eye(matrix.shape[-1])
