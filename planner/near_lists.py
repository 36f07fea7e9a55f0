"""Which bodies can be nearest in each part of the box: what the optimiser looks at instead of all of them.

As in `planner.nearest`: each distance changes by at most a metre a metre, so a body that is farther from the middle of
a cell than the nearest one, by more than the cell's diagonal, is nearest nowhere in the cell. Inside the box nothing is
approximated. Outside of it the outermost cells serve, which may miss a body there; the box is a limit of its own, and
the gate measures to everything.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from planner.accelerator import BODIES_A_KERNEL, on_a_processor
from planner.nearest import Distances, grouped

FEW_CELLS, MANY_CELLS = 4096, 32768
"""As many rows as a table has, for few bodies or many: one shape for all boxes."""
MANY_BODIES = 256
"""From so many on shorter lists are worth the time that more of them take to make."""
SPARE = 2
"""Places left in a list: what is pushed in flight must not make every list longer, which would be compiled anew."""
# Single precision must leave nothing out.
_SLACK_M = 1e-2


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True, eq=False)
class NearLists:
    """A list for each cell of a grid over the box.

    Attributes:
        low_m: Lower corner of the box.
        cells_per_m: Cells a metre of each axis.
        counts: Cells along each axis; their product is at most as many as the table has rows.
        members: What is listed for each cell; the meaning of the numbers is the owner's.
    """

    low_m: Float[np.ndarray | Array, "3"]
    cells_per_m: Float[np.ndarray | Array, "3"]
    counts: Int[np.ndarray | Array, "3"]
    members: Int[np.ndarray | Array, "cell listed"]

    def at(self, x: Array, y: Array, z: Array) -> Int[Array, "*point listed"]:
        """What is listed at points, under jit."""
        axes = jnp.stack([x, y, z], axis=-1)
        cell = jnp.floor((axes - self.low_m) * self.cells_per_m).astype(jnp.int32)
        east, north, up = jnp.moveaxis(jnp.clip(cell, 0, self.counts - 1), -1, 0)
        return jnp.asarray(self.members)[(east * self.counts[1] + north) * self.counts[2] + up]


Carry = TypeVar("Carry")


def each_in_turn(
    look: Callable[[Carry, Array], Carry],
    carry: Carry,
    bodies: int,
    near: NearLists | None,
    at_m: tuple[Array, Array, Array],
) -> Carry:
    """What comes of looking at one body after the other, under jit.

    Args:
        look: From what came of it so far and a body's number, or one number for each point, to what comes of it next.
        carry: What to begin with.
        bodies: How many there are, fillers too: a loop whose length is known needs no word from an accelerator whether
            to go on.
        near: What to look at instead of all.
        at_m: Coordinates of the points.
    """
    listed = jnp.arange(bodies, dtype=jnp.int32) if near is None else jnp.moveaxis(near.at(*at_m), -1, 0)
    together = 1 if on_a_processor() else BODIES_A_KERNEL
    return jax.lax.scan(lambda held, number: (look(held, number), None), carry, listed, unroll=together)[0]


def most_cells(padded: int) -> int:
    """Rows of the table for arrays of so many bodies, fillers too: what is pushed in flight must not change it."""
    return FEW_CELLS if padded < MANY_BODIES else MANY_CELLS


def cell_counts(lengths_m: Float[np.ndarray, "3"], most: int) -> Int[np.ndarray, "3"]:
    """Cells along each axis: about cubes, so many at most."""
    edge_m = float(np.prod(lengths_m) / most) ** (1.0 / 3.0)
    while True:
        counts = np.maximum(1, np.floor(lengths_m / edge_m)).astype(int)
        if np.prod(counts) <= most:
            return counts
        edge_m *= 1.02


def nearest_somewhere(
    low_m: Float[np.ndarray, "3"], high_m: Float[np.ndarray, "3"], most: int, bodies: int, distances: Distances
) -> list[Int[np.ndarray, "some"]]:
    """The bodies that can be nearest in each cell of a box, in the order of `NearLists`.

    Args:
        low_m: Lower corner of the box.
        high_m: Upper corner.
        most: Cells at the most.
        bodies: How many there are, one or more.
        distances: To some of them.
    """
    counts = cell_counts(high_m - low_m, most)
    edges_m = (high_m - low_m) / counts
    grid = np.stack(np.meshgrid(*(np.arange(count) for count in counts), indexing="ij"), axis=-1).reshape(-1, 3)
    middles = low_m + (grid + 0.5) * edges_m
    reach_m = 0.5 * float(np.linalg.norm(edges_m)) + _SLACK_M
    found: list[Int[np.ndarray, "some"]] = [np.empty(0, dtype=int)] * len(middles)
    for cells, some in grouped(middles, np.ones(bodies, dtype=int), distances, reach_m):
        away = distances(middles[cells], some)
        near = away <= away.min(axis=0) + 2.0 * reach_m
        for column, cell in enumerate(cells):
            found[cell] = some[near[:, column]]
    return found


def near_lists(
    low_m: Float[np.ndarray, "3"],
    high_m: Float[np.ndarray, "3"],
    most: int,
    listed: list[Int[np.ndarray, "some"]],
    width: int,
) -> NearLists:
    """Lists as a table.

    Args:
        low_m: Lower corner of the box.
        high_m: Upper corner.
        most: Cells at the most, which are the rows of the table.
        listed: For each cell, in the order of `nearest_somewhere`.
        width: Of the table; −1 fills what is left of a row.
    """
    members = np.full((most, width), -1, dtype=np.int32)
    for row, some in zip(members, listed, strict=False):
        row[: len(some)] = some
    counts = cell_counts(high_m - low_m, most)
    return NearLists(low_m, counts / (high_m - low_m), counts.astype(np.int32), members)
