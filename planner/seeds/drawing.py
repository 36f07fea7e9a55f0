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
from planner.seeds.sizing import Way, Ways, fitted
from planner.seeds.wandering import MOST_PLACES, wander

MOST_ROWS = 200
EAGERNESS = (1.0, 2.0, 1.5, 3.0)
QUANTILES = (0.5, 0.3, 0.7)
SECTOR_RADII = (1.0, 0.6, 1.4)
# Of a way out and back: how finely its length is chosen, and how many random places are looked at for a free one.
OUTWARD_STEPS = 32
PLACES_TRIED = 64


class Pattern(enum.Enum):
    """What a seed grew from."""

    LAWNMOWER = "lawnmower"
    TOUR = "information tour"
    RIDGE = "greedy ridge"
    RANDOM = "random"
    SPIRAL = "spiral"
    SECTORS = "sector search"
    SQUARE = "expanding square"
    DIRECT = "direct way"


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
        # Drawn last of each pattern: about what fits.
        self._sizes: dict[Pattern, int] = {}

    def ways(self, pattern: Pattern, variant: int, rng: np.random.Generator) -> Ways:
        """A pattern, as large as a reach in metres of `FreeSpace.flown_lengths` allows.

        Args:
            pattern: Which.
            variant: Each varies heading, layers, datum or eagerness.
            rng: Of what is left to chance.

        Returns:
            From a reach to the pattern that with the ways to and from it is no longer, as long as one is drawn so
            short.
        """
        match pattern:
            case Pattern.LAWNMOWER:
                return self._lawnmowers(variant)
            case Pattern.TOUR:
                return self._tours(rng)
            case Pattern.RIDGE:
                return self._ridges(variant)
            case Pattern.RANDOM:
                return self._wanderings(rng)
            case Pattern.SPIRAL:
                return self._spirals(variant)
            case Pattern.SECTORS:
                return self._sectors(variant, rng)
            case Pattern.SQUARE:
                return self._squares(variant)
            case Pattern.DIRECT:
                return self._directs(variant, rng)

    def joined(self, way: Way) -> Way:
        """A pattern with the ways to and from it; where the end is free, it ends at its last free point."""
        end = self._problem.end_position_m
        if end is not None:
            return np.concatenate([self._lead_in, way, end[None]])
        open_points = np.flatnonzero(self._free.margin(way) >= 0.0)
        if open_points.size == 0:
            return self._lead_in[[0, -1]]
        return np.concatenate([self._lead_in, way[: open_points[-1] + 1]])

    def _length(self, way: Way) -> float:
        end = self._problem.end_position_m
        joined = np.concatenate([self._lead_in, way] if end is None else [self._lead_in, way, end[None]])
        return float(self._free.flown_lengths(joined).sum())

    def _fitted(self, pattern: Pattern, make: Callable[[int], Way], most: int) -> Ways:
        """A pattern of the size that fits, beginning with the size that was drawn last of its kind."""

        def noted(size: int) -> Way:
            self._sizes[pattern] = size
            return make(size)

        return fitted(noted, self._length, most, self._sizes.get(pattern, 1))

    def _quantile(self, variant: int) -> float:
        """Share of the information below a flight of one altitude: the middle first."""
        return QUANTILES[variant % len(QUANTILES)] if self._altitudes.layered else 0.5

    def _lawnmowers(self, variant: int) -> Ways:
        headings = self._region.headings_rad
        heading = headings[variant % len(headings)]
        layers = 1 + (variant // len(headings) + 1) % 3 if self._altitudes.layered else 1

        def make(rows: int) -> Way:
            levels = self._altitudes.levels(layers)
            return self._nearest_way_round(layered_rows(self._region, heading, rows, levels))

        return self._fitted(Pattern.LAWNMOWER, make, MOST_ROWS)

    def _nearest_way_round(self, way: Way) -> Way:
        """The pattern, or its mirror image, whichever begins and ends with the shorter ways."""
        middle = self._region.center_m
        images = [way, way[::-1]]
        for sign in ((-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)):
            image = way.copy()
            image[:, :2] = middle + np.array(sign) * (way[:, :2] - middle)
            images += [image, image[::-1]]
        # Mirror images cover a fenced area differently; there only the direction is free.
        return min(images[:2] if self._problem.fence_polygon_m is not None else images, key=self._length)

    def _ridges(self, variant: int) -> Ways:
        eagerness, quantile = EAGERNESS[variant % len(EAGERNESS)], self._quantile(variant)
        return lambda reach_m: self._altitudes.lifted(
            greedy_ridge(self._problem, self._lead_in[-1], reach_m, eagerness), quantile
        )

    def _spirals(self, variant: int) -> Ways:
        def make(half_turns: int) -> Way:
            flat = spiral(self._region, half_turns / 2.0)
            if not self._altitudes.layered:
                outward = self._altitudes.lifted(flat, 0.5)
                return outward if variant % 2 == 0 else outward[::-1]
            # Out in one layer and back in the other.
            low, high = self._altitudes.lifted(flat, 0.3), self._altitudes.lifted(flat[::-1], 0.7)
            return np.concatenate([low, high] if variant % 2 == 0 else [high[::-1], low[::-1]])

        return self._fitted(Pattern.SPIRAL, make, MOST_ROWS)

    def _squares(self, variant: int) -> Ways:
        center = peak_m(self._problem) if variant % 2 == 0 else self._region.center_m
        quantile = self._quantile(variant)

        def make(legs: int) -> Way:
            return self._altitudes.lifted(expanding_square(self._region, center, legs), quantile)

        return self._fitted(Pattern.SQUARE, make, MOST_ROWS)

    def _sectors(self, variant: int, rng: np.random.Generator) -> Ways:
        center, heading = peak_m(self._problem), float(rng.uniform(0.0, np.pi))
        radius = spread_m(self._problem, center) * SECTOR_RADII[variant % len(SECTOR_RADII)]
        quantile = self._quantile(variant)

        def make(count: int) -> Way:
            return self._free.clipped(self._altitudes.lifted(sectors(center, radius, count, heading), quantile))

        return self._fitted(Pattern.SECTORS, make, MOST_ROWS // 4)

    def _tours(self, rng: np.random.Generator) -> Ways:
        chance = int(rng.integers(2**32))
        end = self._problem.end_position_m
        vertical_cost = 0.5 * (self._free.climb_cost + self._free.descent_cost)

        def make(count: int) -> Way:
            places = stops(self._problem, count, np.random.default_rng(chance))
            order = tour(self._lead_in[-1], places, end, vertical_cost)
            return order[1:] if end is None else order[1:-1]

        within = self._fitted(Pattern.TOUR, make, MOST_STOPS)
        return lambda reach_m: self._free.pushed(within(reach_m))

    def _wanderings(self, rng: np.random.Generator) -> Ways:
        end = self._problem.end_position_m
        places = rng.uniform(0.05, 0.95, (MOST_PLACES, 3))

        def make(count: int) -> Way:
            way = wander(self._problem.workspace, self._lead_in[-1], places[:count], end)
            return way[1:] if end is None else way[1:-1]

        return self._fitted(Pattern.RANDOM, make, MOST_PLACES)

    def _directs(self, variant: int, rng: np.random.Generator) -> Ways:
        """As little as can be flown: to the end; of a tour, and after the first, by way of one free place."""
        begin, end = self._lead_in[-1], self._problem.end_position_m
        if variant == 0 and end is not None and not np.allclose(begin, end):
            return lambda _: np.zeros((0, 3))
        place = np.array([*self._region.center_m, begin[2]])
        if variant > 0 or self._free.margin(place) < 0.0:
            places = self._problem.workspace.enu_from_unit(rng.uniform(0.05, 0.95, (PLACES_TRIED, 3)))
            place = places[int(np.argmax(self._free.margin(places) >= 0.0))]

        def make(size: int) -> Way:
            return (begin + size / OUTWARD_STEPS * (place - begin))[None]

        return self._fitted(Pattern.DIRECT, make, OUTWARD_STEPS)
