"""The shortest way through free cells: a graph over the whole box, for where nothing simpler leads around."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

MOST_CELLS = 30_000
TAUT_SAMPLES = 24
# Ways up to so many times the straight distance are looked for first: most are.
NEAR = 4.0


class Routes:
    """Free nodes of a regular grid and the ways between neighbours.

    Args:
        low_m: Lower corner of the box.
        high_m: Upper corner of the box.
        margin: For points (..., 3) how far they are from being blocked; negative: blocked.
        vertical_cost: Level metres that a vertical metre is worth.
    """

    def __init__(
        self,
        low_m: Float[np.ndarray, "3"],
        high_m: Float[np.ndarray, "3"],
        margin: Callable[[np.ndarray], np.ndarray],
        vertical_cost: float,
    ) -> None:
        self._margin = margin
        counts = _counts(high_m - low_m)
        axes = [np.linspace(low, high, n) for low, high, n in zip(low_m, high_m, counts, strict=True)]
        nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        free = margin(nodes) >= 0.0
        self._nodes = nodes[free]
        self._cell_m = float(((high_m - low_m) / (np.array(counts) - 1)).max())
        number = np.where(free, np.cumsum(free).reshape(free.shape) - 1, -1)
        rows, columns, weights = [], [], []
        for index in np.ndindex(3, 3, 3):
            shift = np.array(index) - 1
            if index <= (1, 1, 1):
                continue
            here = number[tuple(slice(max(0, -s), n - max(0, s)) for s, n in zip(shift, counts, strict=True))]
            there = number[tuple(slice(max(0, s), n - max(0, -s)) for s, n in zip(shift, counts, strict=True))]
            joined = (here >= 0) & (there >= 0)
            leg = shift * (high_m - low_m) / (np.array(counts) - 1)
            rows.append(here[joined])
            columns.append(there[joined])
            weight = max(float(np.linalg.norm(leg)), abs(float(leg[2])) * vertical_cost)
            weights.append(np.full(int(joined.sum()), weight))
        shape = (len(self._nodes), len(self._nodes))
        self._ways = csr_array((np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))), shape=shape)
        self._tree = KDTree(self._nodes) if len(self._nodes) else None

    def between(self, entry_m: Float[np.ndarray, "3"], leave_m: Float[np.ndarray, "3"]) -> np.ndarray:
        """Points between two places along the shortest way, pulled taut; none where there is no way."""
        if self._tree is None:
            return np.zeros((0, 3))
        source, target = np.asarray(self._tree.query(np.stack([entry_m, leave_m]))[1]).tolist()
        near = NEAR * float(np.linalg.norm(leave_m - entry_m)) + self._cell_m
        for limit in (near, np.inf):
            distance, before = dijkstra(
                self._ways, directed=False, indices=source, return_predecessors=True, limit=limit
            )
            if np.isfinite(distance[target]):
                break
        else:
            return np.zeros((0, 3))
        chain = [target]
        while chain[-1] != source:
            chain.append(int(before[chain[-1]]))
        return self._taut(np.concatenate([entry_m[None], self._nodes[chain[::-1]], leave_m[None]]))[1:-1]

    def _taut(self, path: Float[np.ndarray, "point 3"]) -> Float[np.ndarray, "point 3"]:
        """A path without the points that a straight, free leg can do without."""
        share = np.linspace(0.0, 1.0, TAUT_SAMPLES + 2)[1:-1, None]
        kept, here = [0], 0
        while here < len(path) - 1:
            ahead = path[here + 2 :]
            legs = path[here] + share * (ahead[:, None] - path[here])
            free = np.flatnonzero((self._margin(legs) >= 0.0).all(axis=1)) if len(ahead) else []
            here = here + 2 + int(free[-1]) if len(free) else here + 1
            kept.append(here)
        return path[kept]


def _counts(extent_m: Float[np.ndarray, "3"]) -> tuple[int, int, int]:
    """Nodes along each axis, as even as they can be; at least two."""
    edge = float(extent_m.prod() / MOST_CELLS) ** (1.0 / 3.0)
    counts = np.maximum(np.ceil(extent_m / edge).astype(int) + 1, 2)
    while counts.prod() > MOST_CELLS:
        edge *= 1.05
        counts = np.maximum(np.ceil(extent_m / edge).astype(int) + 1, 2)
    return int(counts[0]), int(counts[1]), int(counts[2])
