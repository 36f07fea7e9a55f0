"""Draws each pattern as large as a length allows, with the ways to and from it in mind but obstacles aside."""

from __future__ import annotations

import enum
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from planner.free_space import FreeSpace
from planner.problem import Problem
from planner.seeds.altitudes import Altitudes
from planner.seeds.informed import MOST_STOPS, greedy_ridge, peak_m, spread_m, stops, tour
from planner.seeds.patterns import Region, expanding_square, layered_rows, sectors, spiral
from planner.seeds.wandering import MOST_PLACES, wander

MOST_ROWS = 200
EAGERNESS = (1.0, 2.0, 1.5, 3.0)
QUANTILES = (0.5, 0.3, 0.7)
SECTOR_RADII = (1.0, 0.6, 1.4)


class Pattern(enum.Enum):
    """What a seed grew from."""

    LAWNMOWER = "lawnmower"
    TOUR = "information tour"
    RIDGE = "greedy ridge"
    RANDOM = "random"
    SPIRAL = "spiral"
    SECTORS = "sector search"
    SQUARE = "expanding square"


class Drawing:
    """The patterns of one problem.

    Args:
        problem: Box, information and end.
        free: Where the vehicle may be.
        lead_in: Where it begins, shape (one or two, 3).
    """

    def __init__(self, problem: Problem, free: FreeSpace, lead_in: Float[np.ndarray, "point 3"]) -> None:
        self._problem, self._free, self._lead_in = problem, free, lead_in
        self._region, self._altitudes = Region(problem), Altitudes(problem)

    def way(
        self, pattern: Pattern, variant: int, rng: np.random.Generator, reach_m: float
    ) -> Float[np.ndarray, "point 3"]:
        """A pattern that with the ways to and from it is no longer than a reach, as long as one is drawn so short.

        Args:
            pattern: Which.
            variant: Each varies heading, layers, datum or eagerness.
            rng: Of what is left to chance.
            reach_m: In metres of `FreeSpace.flown_lengths`.
        """
        match pattern:
            case Pattern.LAWNMOWER:
                return self._lawnmower(variant, reach_m)
            case Pattern.TOUR:
                return self._tour(rng, reach_m)
            case Pattern.RIDGE:
                eagerness = EAGERNESS[variant % len(EAGERNESS)]
                flat = greedy_ridge(self._problem, self._lead_in[-1], reach_m, eagerness)
                return self._altitudes.lifted(flat, self._quantile(variant))
            case Pattern.RANDOM:
                return self._random(rng, reach_m)
            case Pattern.SPIRAL:
                return self._spiral(variant, reach_m)
            case Pattern.SECTORS:
                return self._sectors(variant, rng, reach_m)
            case Pattern.SQUARE:
                return self._square(variant, reach_m)

    def joined(self, way: Float[np.ndarray, "point 3"]) -> Float[np.ndarray, "point 3"]:
        """A pattern with the ways to and from it; where the end is free, it ends at its last free point."""
        end = self._problem.end_position_m
        if end is not None:
            return np.concatenate([self._lead_in, way, end[None]])
        open_points = np.flatnonzero(self._free.margin(way) >= 0.0)
        if open_points.size == 0:
            return self._lead_in[[0, -1]]
        return np.concatenate([self._lead_in, way[: open_points[-1] + 1]])

    def _length(self, way: Float[np.ndarray, "point 3"]) -> float:
        end = self._problem.end_position_m
        joined = np.concatenate([self._lead_in, way] if end is None else [self._lead_in, way, end[None]])
        return float(self._free.flown_lengths(joined).sum())

    def _fitted(
        self, make: Callable[[int], Float[np.ndarray, "point 3"]], most: int, reach_m: float
    ) -> Float[np.ndarray, "point 3"]:
        """The pattern of the largest size, 1 … most, within the reach; of size one where even that is too long."""
        low, high = 1, 2
        while high <= most and self._length(make(high)) <= reach_m:
            low, high = high, 2 * high
        high = min(high, most + 1)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self._length(make(middle)) <= reach_m else (low, middle)
        return make(low)

    def _quantile(self, variant: int) -> float:
        """Share of the information below a flight of one altitude: the middle first."""
        return QUANTILES[variant % len(QUANTILES)] if self._altitudes.layered else 0.5

    def _lawnmower(self, variant: int, reach_m: float) -> Float[np.ndarray, "point 3"]:
        headings = self._region.headings_rad
        heading = headings[variant % len(headings)]
        layers = 1 + (variant // len(headings) + 1) % 3 if self._altitudes.layered else 1

        def make(rows: int) -> Float[np.ndarray, "point 3"]:
            levels = self._altitudes.levels(layers)
            return self._nearest_way_round(layered_rows(self._region, heading, rows, levels))

        return self._fitted(make, MOST_ROWS, reach_m)

    def _nearest_way_round(self, way: Float[np.ndarray, "point 3"]) -> Float[np.ndarray, "point 3"]:
        """The pattern, or its mirror image, whichever begins and ends with the shorter ways."""
        middle = self._region.center_m
        images = [way, way[::-1]]
        for sign in ((-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)):
            image = way.copy()
            image[:, :2] = middle + np.array(sign) * (way[:, :2] - middle)
            images += [image, image[::-1]]
        # Mirror images cover a fenced area differently; there only the direction is free.
        return min(images[:2] if self._problem.fence_polygon_m is not None else images, key=self._length)

    def _spiral(self, variant: int, reach_m: float) -> Float[np.ndarray, "point 3"]:
        def make(half_turns: int) -> Float[np.ndarray, "point 3"]:
            flat = spiral(self._region, half_turns / 2.0)
            if not self._altitudes.layered:
                outward = self._altitudes.lifted(flat, 0.5)
                return outward if variant % 2 == 0 else outward[::-1]
            # Out in one layer and back in the other.
            low, high = self._altitudes.lifted(flat, 0.3), self._altitudes.lifted(flat[::-1], 0.7)
            return np.concatenate([low, high] if variant % 2 == 0 else [high[::-1], low[::-1]])

        return self._fitted(make, MOST_ROWS, reach_m)

    def _square(self, variant: int, reach_m: float) -> Float[np.ndarray, "point 3"]:
        center = peak_m(self._problem) if variant % 2 == 0 else self._region.center_m
        quantile = self._quantile(variant)
        return self._fitted(
            lambda legs: self._altitudes.lifted(expanding_square(self._region, center, legs), quantile),
            MOST_ROWS,
            reach_m,
        )

    def _sectors(self, variant: int, rng: np.random.Generator, reach_m: float) -> Float[np.ndarray, "point 3"]:
        center, heading = peak_m(self._problem), float(rng.uniform(0.0, np.pi))
        radius = spread_m(self._problem, center) * SECTOR_RADII[variant % len(SECTOR_RADII)]
        quantile = self._quantile(variant)

        def make(count: int) -> Float[np.ndarray, "point 3"]:
            return self._free.clipped(self._altitudes.lifted(sectors(center, radius, count, heading), quantile))

        return self._fitted(make, MOST_ROWS // 4, reach_m)

    def _tour(self, rng: np.random.Generator, reach_m: float) -> Float[np.ndarray, "point 3"]:
        chance = int(rng.integers(2**32))
        end = self._problem.end_position_m
        vertical_cost = 0.5 * (self._free.climb_cost + self._free.descent_cost)

        def make(count: int) -> Float[np.ndarray, "point 3"]:
            places = stops(self._problem, count, np.random.default_rng(chance))
            order = tour(self._lead_in[-1], places, end, vertical_cost)
            return order[1:] if end is None else order[1:-1]

        return self._free.pushed(self._fitted(make, MOST_STOPS, reach_m))

    def _random(self, rng: np.random.Generator, reach_m: float) -> Float[np.ndarray, "point 3"]:
        end = self._problem.end_position_m
        places = rng.uniform(0.05, 0.95, (MOST_PLACES, 3))

        def make(count: int) -> Float[np.ndarray, "point 3"]:
            way = wander(self._problem.workspace, self._lead_in[-1], places[:count], end)
            return way[1:] if end is None else way[1:-1]

        return self._fitted(make, MOST_PLACES, reach_m)
