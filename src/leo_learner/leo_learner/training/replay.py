# SPDX-License-Identifier: Apache-2.0
"""Replay buffer: the transitions DDPG learns from, kept as plain arrays."""

from pathlib import Path
from typing import NamedTuple
from zipfile import BadZipFile

import numpy as np

from leo_msgs_py.errors import one_line, UserError


class Transition(NamedTuple):
    observation: np.ndarray
    action: np.ndarray  # in [-1, 1]
    reward: float
    following: np.ndarray
    terminated: bool


class Batch(NamedTuple):
    """Transitions side by side, unscaled; the first axis is the batch, float32."""

    observations: np.ndarray  # (B, n_obs)
    actions: np.ndarray  # (B, n_act), in [-1, 1]
    rewards: np.ndarray  # (B,)
    next_observations: np.ndarray  # (B, n_obs)
    terminated: np.ndarray  # (B,), 1 where the episode ended in an absorbing state, not by time


class Replay:
    """Ring of the last `capacity` transitions, sampled uniformly with replacement."""

    def __init__(self, capacity: int, n_obs: int, n_act: int) -> None:
        self.capacity = capacity
        self.added = 0
        shapes = (0, n_obs), (0, n_act), 0, (0, n_obs), 0
        self._rows = Batch(*(np.zeros(shape, np.float32) for shape in shapes))

    def __len__(self) -> int:
        return min(self.added, self.capacity)

    def add(self, transition: Transition) -> None:
        row = self.added % self.capacity
        held = len(self._rows.rewards)
        if row >= held:
            rows = min(self.capacity, max(1024, 2 * held))
            self._rows = Batch(*(np.resize(c, (rows, *c.shape[1:])) for c in self._rows))
        for column, value in zip(self._rows, transition, strict=True):
            column[row] = value
        self.added += 1

    def sample(self, size: int, rng: np.random.Generator) -> Batch:
        rows = rng.integers(len(self), size=size)
        return Batch(*(column[rows] for column in self._rows))

    def all(self) -> Batch:
        return Batch(*(column[: len(self)] for column in self._rows))

    def save(self, path: Path) -> None:
        np.savez(path, added=np.int64(self.added), **self.all()._asdict())

    def load(self, path: Path, limit: int | None = None) -> None:
        """Replace what is held by the first `limit` (all) transitions of a file of `save`.

        UserError: the file is damaged, or of other sizes than this buffer.
        """
        try:
            with path.open('rb') as stream, np.load(stream) as stored:
                columns = Batch(*(stored[name][:limit] for name in Batch._fields))
                added = int(stored['added']) if limit is None else len(columns.rewards)
        except (OSError, EOFError, KeyError, ValueError, BadZipFile) as error:
            raise UserError(
                f'{path} cannot be read ({one_line(error)}); remove {path.parent} to start anew'
            ) from error
        for name, new, own in zip(Batch._fields, columns, self._rows, strict=True):
            if new.shape[1:] != own.shape[1:]:
                raise UserError(
                    f'{path} holds {name} of shape {new.shape[1:]}, this robot has '
                    f'{own.shape[1:]}; resume with the robot the run was started with'
                )
        if len(columns.rewards) > self.capacity:
            raise UserError(
                f'{path} holds {len(columns.rewards)} transitions, the buffer {self.capacity}; '
                'resume with the configuration the run was started with'
            )
        self._rows, self.added = columns, added
