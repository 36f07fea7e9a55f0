"""A set of different paths to start from: what teams fly today, what follows the information, and chance.

Each is cut to the free space, as long as the vehicle can fly in the time there is, and given as positions in time.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from planner.free_space import FreeSpace
from planner.problem import Problem
from planner.seeds.drawing import Drawing, Pattern
from planner.seeds.pacing import lead_in, led_to_the_end, paced, reach_m

MOMENTS = 1025
# A pattern is drawn again, larger or smaller, until it fills the time this well.
FIRST_SHARE = 0.88
WELL_FILLED = 0.9
FITTING_ROUNDS = 3
# So many are drawn however little time there is: of different kinds, one is likely to be free.
FEWEST_DRAWN = 3
# Where there is no time to draw more, what there is varies by so much of the box, in waves of one half to three halves.
VARIATION = 0.04
WAVES = 3
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
LAST_RESORT = (Pattern.DIRECT,)
"""Where nothing comes of those, what is likeliest to be feasible."""


@dataclasses.dataclass(frozen=True)
class SeedPath:
    """A path to start from.

    Attributes:
        pattern: What it grew from.
        points_m: Positions at equal times over the problem's duration, shape (moment, 3).
    """

    pattern: str
    points_m: Float[np.ndarray, "moment 3"]


def seed_paths(
    problem: Problem,
    count: int,
    rng: np.random.Generator,
    go_on: Callable[[], bool] = lambda: True,
    order: Sequence[Pattern] = ORDER,
) -> list[SeedPath]:
    """Different paths from the problem's start to its end.

    Args:
        problem: What to explore.
        count: How many.
        rng: Of every choice left to chance: the same generator state gives the same paths.
        go_on: Asked before each but the first few whether there is time to draw it; the missing ones are variations of
            those that were drawn.
        order: Which patterns, in order and round again.
    """
    cutter = _Cutter(problem)
    used = dict.fromkeys(Pattern, 0)
    seeds = []
    for pattern in itertools.islice(itertools.cycle(order), count):
        if len(seeds) >= FEWEST_DRAWN and not go_on():
            break
        seeds.append(SeedPath(pattern.value, cutter.path(pattern, used[pattern], int(rng.integers(2**32)))))
        used[pattern] += 1
    return seeds + [
        _varied(seed, problem, rng) for seed in itertools.islice(itertools.cycle(seeds), count - len(seeds))
    ]


def _varied(seed: SeedPath, problem: Problem, rng: np.random.Generator) -> SeedPath:
    """The same path swung aside a little, its ends kept."""
    wave = np.arange(1, WAVES + 1)
    swing_m = VARIATION * problem.workspace.lengths_m * rng.normal(size=(WAVES, 3)) / wave[:, None]
    along = np.linspace(0.0, np.pi, len(seed.points_m))
    points = seed.points_m + np.sin(along[:, None] * wave) @ swing_m
    points = np.clip(points, problem.workspace.box_min_m, problem.workspace.box_max_m)
    points[[0, -1]] = seed.points_m[[0, -1]]
    return SeedPath(seed.pattern, points)


class _Cutter:
    """Cuts patterns to the free space and to the time there is: what they share is made once."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._free = FreeSpace(problem)
        self._drawing = Drawing(problem, self._free, lead_in(problem))
        self._longest = reach_m(problem)

    def path(self, pattern: Pattern, variant: int, chance: int) -> Float[np.ndarray, "moment 3"]:
        """Positions in time of one pattern, cut, led to the end, and paced.

        Args:
            pattern: Which.
            variant: How often it was used before.
            chance: Seed of what is left to chance.
        """
        problem, free = self._problem, self._free
        longest, reach, best = self._longest, FIRST_SHARE * self._longest, None
        ways = self._drawing.ways(pattern, variant, np.random.default_rng(chance))
        for _ in range(FITTING_ROUNDS):
            path = led_to_the_end(free.path_through(self._drawing.joined(ways(reach))), problem, free, longest)
            positions, excess = paced(path, problem, free, MOMENTS)
            # Of those that fit the longest, of those that do not the shortest.
            rank = excess if excess <= 1.0 else -excess
            if best is not None and rank == best[0]:
                break
            if best is None or rank > best[0]:
                best = rank, positions
            if WELL_FILLED <= excess <= 1.0:
                break
            # Corners and ways around cost time that the pattern's length does not show.
            aim = 0.5 * (WELL_FILLED + 1.0) / excess
            longest = min(longest, aim * longest)
            reach = min(aim * reach, longest)
        assert best is not None
        return best[1]
