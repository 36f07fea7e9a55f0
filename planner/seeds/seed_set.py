"""A set of different paths to start from: what teams fly today, what follows the information, and chance.

Each is cut to the free space, as long as the vehicle can fly in the time there is, and given as positions in time.
"""

from __future__ import annotations

import dataclasses
import enum
import itertools
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from planner.free_space import FreeSpace
from planner.problem import Problem
from planner.seeds.altitudes import Altitudes
from planner.seeds.informed import MOST_STOPS, greedy_ridge, peak_m, spread_m, stops, tour
from planner.seeds.pacing import lead_in, led_to_the_end, paced, reach_m
from planner.seeds.patterns import Region, expanding_square, lawnmower, sectors, spiral
from planner.seeds.wandering import MOST_WAVES, wander

MOMENTS = 1025
MOST_ROWS = 200


class Pattern(enum.Enum):
    """What a seed grew from."""

    LAWNMOWER = "lawnmower"
    TOUR = "information tour"
    RIDGE = "greedy ridge"
    RANDOM = "random"
    SPIRAL = "spiral"
    SECTORS = "sector search"
    SQUARE = "expanding square"


# In this order and round again: each round varies heading, layers, datum or chance.
ORDER = (
    Pattern.LAWNMOWER,
    Pattern.TOUR,
    Pattern.RIDGE,
    Pattern.RANDOM,
    Pattern.SPIRAL,
    Pattern.LAWNMOWER,
    Pattern.TOUR,
    Pattern.SECTORS,
    Pattern.RANDOM,
    Pattern.SQUARE,
    Pattern.TOUR,
    Pattern.RANDOM,
)


@dataclasses.dataclass(frozen=True)
class SeedPath:
    """A path to start from.

    Attributes:
        pattern: What it grew from.
        points_m: Positions at equal times over the problem's duration, shape (moment, 3).
    """

    pattern: str
    points_m: Float[np.ndarray, "moment 3"]


def seed_paths(problem: Problem, count: int, rng: np.random.Generator) -> list[SeedPath]:
    """Different paths from the problem's start to its end.

    Args:
        problem: What to explore.
        count: How many.
        rng: Of every choice left to chance: the same generator state gives the same paths.
    """
    drawing = _Drawing(problem, rng)
    used = dict.fromkeys(Pattern, 0)
    seeds = []
    for pattern in itertools.islice(itertools.cycle(ORDER), count):
        path = drawing.path(pattern, used[pattern])
        used[pattern] += 1
        seeds.append(SeedPath(pattern.value, path))
    return seeds


class _Drawing:
    """Draws the patterns of one problem: what they share is made once."""

    def __init__(self, problem: Problem, rng: np.random.Generator) -> None:
        self._problem, self._rng = problem, rng
        self._free = FreeSpace(problem)
        self._region = Region(problem)
        self._altitudes = Altitudes(problem)
        self._reach = reach_m(problem)
        self._lead_in = lead_in(problem)

    def path(self, pattern: Pattern, variant: int) -> Float[np.ndarray, "moment 3"]:
        """Positions in time of one pattern, cut, led to the end, and paced."""
        match pattern:
            case Pattern.LAWNMOWER:
                way = self._lawnmower(variant)
            case Pattern.TOUR:
                way = self._tour()
            case Pattern.RIDGE:
                flat = greedy_ridge(self._problem, self._lead_in[-1], self._reach, (1.0, 2.0, 1.5, 3.0)[variant % 4])
                way = self._altitudes.lifted(flat, self._quantile(variant))
            case Pattern.RANDOM:
                way = self._random()
            case Pattern.SPIRAL:
                way = self._spiral(variant)
            case Pattern.SECTORS:
                way = self._sectors(variant)
            case Pattern.SQUARE:
                way = self._square(variant)
        free = self._free
        path = led_to_the_end(free.path_through(self._joined(way)), self._problem, free)
        return paced(path, self._problem, free, MOMENTS)

    def _joined(self, way: Float[np.ndarray, "point 3"]) -> Float[np.ndarray, "point 3"]:
        """A pattern with the ways to and from it."""
        end = self._problem.end_position_m
        return np.concatenate([self._lead_in, way] if end is None else [self._lead_in, way, end[None]])

    def _length(self, way: Float[np.ndarray, "point 3"]) -> float:
        """How long a pattern is with the ways to and from it, obstacles aside."""
        return float(self._free.flown_lengths(self._joined(way)).sum())

    def _fitted(self, make: Callable[[int], Float[np.ndarray, "point 3"]], most: int) -> Float[np.ndarray, "point 3"]:
        """The pattern of the largest size, 1 … most, that can be flown; of size one where even that is too long."""
        low, high = 1, 2
        while high <= most and self._length(make(high)) <= self._reach:
            low, high = high, 2 * high
        high = min(high, most + 1)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self._length(make(middle)) <= self._reach else (low, middle)
        return make(low)

    def _quantile(self, variant: int) -> float:
        """Share of the information below a flight of one altitude: the middle first."""
        return (0.5, 0.3, 0.7)[variant % 3] if self._altitudes.layered else 0.5

    def _lawnmower(self, variant: int) -> Float[np.ndarray, "point 3"]:
        headings = self._region.headings_rad
        heading = headings[variant % len(headings)]
        layers = 1 + (variant // len(headings) + 1) % 3 if self._altitudes.layered else 1

        def make(rows: int) -> Float[np.ndarray, "point 3"]:
            return self._nearest_way_round(layered_rows(self._region, self._altitudes, heading, rows, layers))

        return self._fitted(make, MOST_ROWS)

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

    def _spiral(self, variant: int) -> Float[np.ndarray, "point 3"]:
        there_and_back = self._altitudes.layered

        def make(half_turns: int) -> Float[np.ndarray, "point 3"]:
            flat = spiral(self._region, half_turns / 2.0)
            if not there_and_back:
                outward = self._altitudes.lifted(flat, 0.5)
                return outward if variant % 2 == 0 else outward[::-1]
            low, high = self._altitudes.lifted(flat, 0.3), self._altitudes.lifted(flat[::-1], 0.7)
            return np.concatenate([low, high] if variant % 2 == 0 else [high, low])

        return self._fitted(make, MOST_ROWS)

    def _square(self, variant: int) -> Float[np.ndarray, "point 3"]:
        center = peak_m(self._problem) if variant % 2 == 0 else self._region.center_m
        quantile = self._quantile(variant)
        return self._fitted(
            lambda legs: self._altitudes.lifted(expanding_square(self._region, center, legs), quantile), MOST_ROWS
        )

    def _sectors(self, variant: int) -> Float[np.ndarray, "point 3"]:
        center, heading = peak_m(self._problem), float(self._rng.uniform(0.0, np.pi))
        radius = spread_m(self._problem, center) * (1.0, 0.6, 1.4)[variant % 3]
        quantile = self._quantile(variant)
        return self._fitted(
            lambda count: self._altitudes.lifted(sectors(center, radius, count, heading), quantile), MOST_ROWS // 4
        )

    def _tour(self) -> Float[np.ndarray, "point 3"]:
        seed = int(self._rng.integers(2**32))

        def make(count: int) -> Float[np.ndarray, "point 3"]:
            places = self._free.pushed(stops(self._problem, count, np.random.default_rng(seed)))
            order = tour(self._lead_in[-1], places, self._problem.end_position_m)
            return order[1:] if self._problem.end_position_m is None else order[1:-1]

        return self._fitted(make, MOST_STOPS)

    def _random(self) -> Float[np.ndarray, "point 3"]:
        end = self._problem.end_position_m
        workspace = self._problem.workspace
        chance = workspace.enu_from_unit(self._rng.uniform(0.1, 0.9, 3))
        amplitude = self._rng.normal(size=(MOST_WAVES, 3))
        last = chance if end is None else end
        return self._fitted(lambda waves: wander(self._problem, last, waves, amplitude), MOST_WAVES)


def layered_rows(
    region: Region, altitudes: Altitudes, heading_rad: float, rows: int, layers: int, inset_m: float | None = None
) -> Float[np.ndarray, "point 3"]:
    """A lawnmower in one or more level layers, each across the one before.

    Args:
        region: What is covered.
        altitudes: Where the layers go: at equal shares of the information.
        heading_rad: Direction of the first layer's rows, from east.
        rows: Rows a layer.
        layers: How many layers.
        inset_m: How far rows end before the border; None: half a spacing.
    """
    parts = []
    for layer in range(layers):
        flat = lawnmower(region, heading_rad + 0.5 * np.pi * layer, rows, inset_m)
        level = altitudes.level((layer + 0.5) / layers)
        if parts and np.linalg.norm(flat[0] - parts[-1][-1, :2]) > np.linalg.norm(flat[-1] - parts[-1][-1, :2]):
            flat = flat[::-1]
        parts.append(np.column_stack([flat, np.full(len(flat), level)]))
    return np.concatenate(parts)
