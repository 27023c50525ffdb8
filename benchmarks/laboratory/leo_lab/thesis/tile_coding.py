# SPDX-License-Identifier: Apache-2.0
"""Hashed tile coding over observation and action, a weight per tile (docs/reference/leo.md 8).

Miller and Glanz: an input x is cut into steps of width / tilings, and tiling j is displaced by
j (1 + 2 i) of these steps in dimension i, observations first, then actions.

Collisions are checked: a tile's 64-bit hash gives its place in the memory and a 32-bit mark. A
tile that learns claims the first free cell from its place on; a cell with another mark belongs to
another tile. So no two tiles share a weight unless place and mark agree (once in 2^57 pairs), or
`PROBES` cells in a row are taken, as in a memory almost full; then a tile uses the one at its
place, whoever owns it. A tile that has not learned yet has no cell: its weight is the random
number that its hash and the seed give, which is also what it claims its cell with.

One module: numba's cache does not notice a change in a module that compiled code calls into.
"""

from collections.abc import Mapping

import numpy as np

from leo_sim.common.compiled import compiled

PROBES = 256
GOLDEN = np.uint64(0x9E3779B97F4A7C15)


class TileCoding:
    """Values of N given actions (N, A) for any observation: the mean of one weight per tiling.

    The widths of a tile are those per observation and then per action, in their units. There are
    `memory` cells, a power of two, whose weights (memory,) float32 start as U(0, initial).
    """

    def __init__(
        self,
        widths: np.ndarray,
        actions: np.ndarray,
        tilings: int,
        memory: int,
        initial: float,
        seed: int,
    ) -> None:
        n_obs = len(widths) - actions.shape[1]
        self._steps = tilings / np.asarray(widths[:n_obs], float)
        self._initial, self._tilings = np.float32(initial), tilings
        self._salt = np.uint64(mixed(np.uint64(seed) ^ GOLDEN))
        keys = [tile_keys(a, tilings / widths[n_obs:], n_obs, tilings) for a in actions]
        unique = [np.unique(column, return_inverse=True) for column in np.array(keys).T]
        self._counts = np.array([len(own) for own, _ in unique])
        self._keys = np.zeros((tilings, self._counts.max()), np.uint64)
        for row, (own, _) in zip(self._keys, unique, strict=True):
            row[: len(own)] = own
        self._groups = np.array([inverse for _, inverse in unique])
        self._free(memory)

    def values(self, observation: np.ndarray) -> np.ndarray:
        """Of all actions, (N,)."""
        observed, start = self._observed(observation), (self._salt, self._initial)
        tiles = self._keys, self._counts, self._groups
        return np.asarray(values(self._cells, self.weights, observed, *tiles, *start))

    def claim(self, observation: np.ndarray, action: int) -> np.ndarray:
        """The cells (T,) of an observation and the action with that number, claimed if new."""
        own = self._keys[np.arange(self._tilings), self._groups[:, action]]
        observed, start = self._observed(observation), (self._salt, self._initial)
        return np.asarray(claim(self._cells, self.weights, observed, own, *start))

    def claimed(self) -> dict[str, np.ndarray]:
        """All cells in use: `slot` (C,) int32, `mark` (C,) int32, `weight` (C,) float32."""
        slots = np.flatnonzero(self._cells[:, 0])
        marks = self._cells[slots, 0].view(np.int32)
        return {'slot': slots.astype(np.int32), 'mark': marks, 'weight': self.weights[slots]}

    def restore(self, claimed: Mapping[str, np.ndarray]) -> None:
        """Put the memory where `claimed` found it. ValueError: it is of another, larger memory."""
        slots = claimed['slot']
        if len(slots) and not 0 <= slots.min() <= slots.max() < len(self._cells):
            raise ValueError(f'its tiles do not fit into a memory of {len(self._cells)}')
        self._free(len(self._cells))
        self._cells[slots, 0] = claimed['mark'].view(np.uint32)
        self.weights[slots] = claimed['weight']

    def _free(self, memory: int) -> None:
        """All cells free: mark 0, and the weight in the same cache line."""
        self._cells = np.zeros((memory, 2), np.uint32)
        self.weights: np.ndarray = self._cells.view(np.float32)[:, 1]

    def _observed(self, observation: np.ndarray) -> np.ndarray:
        return tile_keys(np.asarray(observation, float), self._steps, 0, self._tilings)


@compiled
def mixed(key: np.uint64) -> np.uint64:
    """All bits of a number spread over all bits (the finaliser of SplitMix64)."""
    key = (key ^ (key >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    key = (key ^ (key >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return key ^ (key >> np.uint64(31))


@compiled
def tile_keys(inputs: np.ndarray, steps: np.ndarray, first: int, tilings: int) -> np.ndarray:
    """Hash (T,) of the tile that holds inputs (n,), from dimension `first` on, in each tiling.

    `steps` are those per unit of each input, tilings / width, (n,).
    """
    keys = np.empty(tilings, np.uint64)
    for j in range(tilings):
        key = mixed(np.uint64(tilings * first + j) + GOLDEN)
        for i in range(len(inputs)):
            step = int(np.floor(inputs[i] * steps[i]))
            tile = (step - j * (1 + 2 * (first + i))) // tilings
            key = mixed(key ^ (np.uint64(tile) * GOLDEN))
        keys[j] = key
    return keys


@compiled
def find(cells: np.ndarray, key: np.uint64) -> np.int64:
    """Cell of a tile; -1 - cell for the free one it would claim."""
    mask = np.uint64(len(cells) - 1)
    mark = max(np.uint32(1), np.uint32(key >> np.uint64(32)))
    for probe in range(PROBES):
        slot = np.int64((key + np.uint64(probe)) & mask)
        if cells[slot, 0] == mark:
            return slot
        if cells[slot, 0] == 0:
            return -1 - slot
    return np.int64(key & mask)


@compiled
def start(key: np.uint64, salt: np.uint64, initial: np.float32) -> np.float32:
    """Weight of a tile before it learns, U(0, initial)."""
    share = np.float64(mixed(key ^ salt) >> np.uint64(11)) * 2.0**-53
    return np.float32(share * initial)


@compiled
def values(
    cells: np.ndarray,
    weights: np.ndarray,
    observed: np.ndarray,
    keys: np.ndarray,
    counts: np.ndarray,
    groups: np.ndarray,
    salt: np.uint64,
    initial: np.float32,
) -> np.ndarray:
    """Values (N,) of all actions, from the cells (memory, 2) uint32 of marks and weights.

    `weights` are the latter as float32, `observed` the observation's hash per tiling, (T,). `keys`
    are the `counts` (T,) different hashes of the actions per tiling, (T, at most N): many actions
    are in one tile, which is looked up once. `groups` says which of them each action has, (T, N).
    """
    tilings, actions = groups.shape
    total, own = np.zeros(actions), np.empty(keys.shape[1])
    for j in range(tilings):
        for k in range(counts[j]):
            key = mixed(observed[j] ^ keys[j, k])
            slot = find(cells, key)
            own[k] = weights[slot] if slot >= 0 else start(key, salt, initial)
        for n in range(actions):
            total[n] += own[groups[j, n]]
    return total / tilings


@compiled
def claim(
    cells: np.ndarray,
    weights: np.ndarray,
    observed: np.ndarray,
    own: np.ndarray,
    salt: np.uint64,
    initial: np.float32,
) -> np.ndarray:
    """Cells (T,) of an observation and action (hashes, (T,)), claimed where free; see `values`."""
    slots = np.empty(len(own), np.int64)
    for j in range(len(own)):
        key = mixed(observed[j] ^ own[j])
        slot = find(cells, key)
        if slot < 0:
            slot = -1 - slot
            cells[slot, 0] = max(np.uint32(1), np.uint32(key >> np.uint64(32)))
            weights[slot] = start(key, salt, initial)
        slots[j] = slot
    return slots


@compiled
def add(weights: np.ndarray, traces: np.ndarray, steps: int, change: float, decay: float) -> None:
    """Add `change` to the weights of the newest cells, `change` decay^k to those k steps before.

    `traces` is a ring of the cells of the latest steps, (K, T); of `steps`, n is in row n mod K.
    """
    for back in range(min(steps, len(traces))):
        for slot in traces[(steps - 1 - back) % len(traces)]:
            weights[slot] += np.float32(change)
        change *= decay
