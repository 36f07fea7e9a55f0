"""The honest baseline: the best lawnmower of a path's own length over the same free space.

Rows along each heading that suits the area, so many that the length is used up, in one to three layers where the
information changes with altitude, either way round, led around what is in the way. It need not come from or go to
anywhere, nor slow down: what a planner is compared with has every advantage.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterator

import numpy as np
from jaxtyping import Float

from planner.free_space import FreeSpace
from planner.polyline import at_lengths, length_of
from planner.problem import Problem
from planner.seeds.altitudes import Altitudes
from planner.seeds.patterns import Region, layered_rows

SAMPLES = 1000
MOST_ROWS = 400
# From the least rows that use up the length so many more, whose ends keep further from the border.
MORE_ROWS = 3
MOST_LAYERS = 3
# Ranked without obstacles first; so many of the best are led around them.
FINALISTS = 4
RANKING_SAMPLES = 300
FITTING_ROUNDS = 5
LENGTH_TOLERANCE = 0.02
DETOUR_ROUNDS = 2


@dataclasses.dataclass(frozen=True)
class Rows:
    """One lawnmower before it is fitted to a length.

    Attributes:
        heading_rad: Direction of the first layer's rows, from east.
        rows: Rows of all layers together.
        layers: How many layers.
        mirrored: Whether the first row begins at its other end.
    """

    heading_rad: float
    rows: int
    layers: int
    mirrored: bool


class Lawnmowers:
    """The lawnmowers of one length, drawn once for whatever they are measured by.

    Args:
        problem: Box, fence, obstacles and information.
        length_m: Length of the path to compare with, positive.

    Raises:
        ValueError: A length that is not positive.
    """

    def __init__(self, problem: Problem, length_m: float) -> None:
        if not length_m > 0.0:
            raise ValueError(f"a lawnmower needs a length, got {length_m} m")
        self._free = FreeSpace(problem, allowance=1.0)
        self._region, self._altitudes = Region(problem), Altitudes(problem)
        self._length_m = length_m
        paths = [(rows, self._fitted(rows, length_m)) for rows in self._variants()]
        # What is too short between its rows' insets is no match.
        long_enough = [one for one in paths if length_of(one[1]) >= (1.0 - LENGTH_TOLERANCE) * length_m]
        self._paths = long_enough or paths

    def best(self, metric: Callable[[Float[np.ndarray, "time 3"]], float]) -> tuple[float, Float[np.ndarray, "time 3"]]:
        """The lowest metric of them.

        Args:
            metric: From positions at equal times (time, 3) to a figure; less is better.

        Returns:
            The figure, and the lawnmower's positions at equal times, shape (time, 3).
        """
        figures = [metric(self._sampled(path, RANKING_SAMPLES)) for _, path in self._paths]
        finalists = [self._paths[index] for index in np.argsort(figures)[:FINALISTS]]
        candidates = [
            self._sampled(path if self._free.is_open else self._around(rows, path)) for rows, path in finalists
        ]
        final = [metric(positions) for positions in candidates]
        best = int(np.argmin(final))
        return final[best], candidates[best]

    def _variants(self) -> Iterator[Rows]:
        """Headings, layers, rows and directions worth comparing."""
        layer_counts = range(1, MOST_LAYERS + 1) if self._altitudes.layered else (1,)
        for heading, layers in itertools.product(self._region.headings_rad, layer_counts):
            fewest = self._fewest_rows(heading, layers)
            more = range(fewest, fewest + MORE_ROWS * layers)
            for rows, mirrored in itertools.product(more, (False, True)):
                yield Rows(heading, rows, layers, mirrored)

    def _fewest_rows(self, heading_rad: float, layers: int) -> int:
        """Least rows that, border to border, use up the length."""
        low, high = 0, 1
        while high < MOST_ROWS and length_of(self._path(Rows(heading_rad, high, layers, False), 0.0)) < self._length_m:
            low, high = high, 2 * high
        while high - low > 1:
            middle = (low + high) // 2
            enough = length_of(self._path(Rows(heading_rad, middle, layers, False), 0.0)) >= self._length_m
            low, high = (low, middle) if enough else (middle, high)
        return high

    def _path(self, rows: Rows, inset_m: float) -> Float[np.ndarray, "point 3"]:
        heading = rows.heading_rad + (np.pi if rows.mirrored else 0.0)
        return layered_rows(self._region, heading, rows.rows, self._altitudes.levels(rows.layers), inset_m)

    def _fitted(self, rows: Rows, length_m: float) -> Float[np.ndarray, "point 3"]:
        """Rows whose ends keep so far from the border that the length is met, obstacles aside."""
        inset, path = 0.0, self._path(rows, 0.0)
        for _ in range(FITTING_ROUNDS):
            excess = length_of(path) - length_m
            if abs(excess) < 5e-4 * length_m or (excess < 0.0 and inset == 0.0):
                break
            # Each row loses its inset at both ends.
            inset = max(0.0, inset + excess / (2.0 * rows.rows))
            path = self._path(rows, inset)
        return path

    def _around(self, rows: Rows, path: Float[np.ndarray, "point 3"]) -> Float[np.ndarray, "point 3"]:
        """The same rows led around what is in the way, as much shorter as the ways around are longer."""
        wanted, flown = self._length_m, [self._free.path_through(path)]
        for _ in range(DETOUR_ROUNDS):
            wanted *= self._length_m / length_of(flown[-1])
            flown.append(self._free.path_through(self._fitted(rows, wanted)))
        long_enough = [way for way in flown if length_of(way) >= self._length_m]
        return min(long_enough, key=length_of) if long_enough else max(flown, key=length_of)

    def _sampled(self, path: Float[np.ndarray, "point 3"], count: int = SAMPLES) -> Float[np.ndarray, "time 3"]:
        """Positions at equal times; what is longer than the length is cut at the end."""
        legs = np.linalg.norm(np.diff(path, axis=0), axis=1)
        # The middles of equal parts stand for equal times.
        along = (np.arange(count) + 0.5) / count * min(self._length_m, float(legs.sum()))
        return at_lengths(path, legs, along)
