"""What a search finds: the product against what teams fly and against ergodic paths without a search in mind.

    python -m benchmarks.search [MAP.npz …]

Each map is a probability of where somebody is, in cells of 30 m (the example's own where none is given); the middle
3.6 km of it, 15 km of path, and a sensor that notices all it sees within 33 m. What is found is the probability of the
ground within that distance of the path, on cells of a third of it, so nothing is gained by passing over the middles of
cells. The last column counts as is often done, by the middles of the map's own cells: a path from middle to middle
then seems to sweep 90 m. Hand-flown patterns know no acceleration and no start: they have every advantage.
"""

from __future__ import annotations

import dataclasses
import math
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from benchmarks.timing import machine
from planner.effort import Search
from planner.information import DensityGrid, raster
from planner.lawnmower import Lawnmowers
from planner.obstacles import ObstacleField
from planner.plan import Candidate
from planner.polyline import at_lengths, densified, length_of
from planner.problem import Limits, Options, Problem
from planner.seeds.altitudes import Altitudes
from planner.seeds.patterns import Region, spiral
from planner.solver import solve
from planner.trajectory import Motion
from planner.workspace import Workspace

CELL_M, RADIUS_M, LENGTH_M, SPEED_MPS = 30.0, 33.0, 15_000.0, 10.0
BOX = Workspace(np.array([-1800.0, -1800.0, 60.0]), np.array([1800.0, 1800.0, 100.0]))
START_M = np.array([0.0, 0.0, 80.0])
MODES = (48, 48, 1)
CANDIDATES = 8
EAGERNESS = (1.0, 2.0, 3.0)
LOOK_M = 3.0


def prior_of(path: Path) -> tuple[DensityGrid, float]:
    """A map's middle, and its share of the whole map."""
    with np.load(path) as file:
        values = np.asarray(file["probability" if "probability" in file else file.files[0]], dtype=float)
    # Rows run from north to south.
    east_north = values[::-1].T
    low = -0.5 * CELL_M * np.array(east_north.shape)
    grid = raster(BOX, east_north, low, np.full(2, CELL_M))
    centers = [(np.arange(count) + 0.5) * CELL_M + corner for count, corner in zip(east_north.shape, low, strict=True)]
    inside = np.ix_(*(np.abs(center) < 1800.0 for center in centers))
    return grid, float(east_north[inside].sum() / east_north.sum())


class Ground:
    """What a path has seen of it, by the middles of cells."""

    def __init__(self, cells: DensityGrid) -> None:
        self._mass = cells.map_mass.reshape(-1)
        self._places = cells.map_centers_m().reshape(-1, 2)

    def seen(self, path_m: np.ndarray) -> float:
        """Probability within the radius of the first `LENGTH_M` of a path."""
        legs = np.linalg.norm(np.diff(path_m[:, :2], axis=0), axis=1)
        reach = min(LENGTH_M, float(legs.sum()))
        path = densified(at_lengths(path_m[:, :2], legs, np.linspace(0.0, reach, 20_000)), LOOK_M)
        away, _ = KDTree(path).query(self._places, distance_upper_bound=RADIUS_M)
        return float(self._mass[np.isfinite(away)].sum())

    def most(self) -> float:
        """Of the best ground that so long a path can sweep."""
        cell_m2 = float(np.prod(BOX.lengths_m[:2])) / len(self._mass)
        return float(np.sort(self._mass)[::-1][: int(2.0 * RADIUS_M * LENGTH_M / cell_m2)].sum())


def greedy(prior: DensityGrid, eagerness: float) -> np.ndarray:
    """Always on to the unseen cell with the most for the way there; what lies beside the way is seen too."""
    left = prior.map_mass.reshape(-1).copy()
    places = prior.map_centers_m().reshape(-1, 2)
    tree, path, flown = KDTree(places), [START_M[:2]], 0.0
    while flown < LENGTH_M:
        away = np.linalg.norm(places - path[-1], axis=1)
        following = places[int(np.argmax(left / np.maximum(away, CELL_M) ** eagerness))]
        leg = np.linspace(path[-1], following, 2 + int(np.linalg.norm(following - path[-1]) / LOOK_M))
        for near in tree.query_ball_point(leg, RADIUS_M):
            left[near] = 0.0
        flown += float(np.linalg.norm(following - path[-1]))
        path.append(following)
    return np.array(path)


def greedy_steps(prior: DensityGrid) -> np.ndarray:
    """From the peak on to whichever cell within two of here adds the most for the way there."""
    left = prior.map_mass.copy()
    places, tree = prior.map_centers_m(), KDTree(prior.map_centers_m().reshape(-1, 2))
    here = np.array(np.unravel_index(np.argmax(left), left.shape))
    steps = [np.array((east, north)) for east in range(-2, 3) for north in range(-2, 3) if 2 in (abs(east), abs(north))]

    def swept(to: np.ndarray) -> np.ndarray:
        leg_m = densified(np.stack([places[tuple(here)], places[tuple(to)]]), LOOK_M)
        return np.unique(np.concatenate([np.array(near, dtype=int) for near in tree.query_ball_point(leg_m, RADIUS_M)]))

    path, flown = [places[tuple(here)]], 0.0
    while flown < LENGTH_M:
        ways = [here + step for step in steps if np.all((here + step >= 0) & (here + step < left.shape))]
        adds = [left.reshape(-1)[swept(to)].sum() / np.linalg.norm(to - here) for to in ways]
        to = ways[int(np.argmax(adds))]
        if max(adds) <= 0.0:
            away = np.maximum(np.linalg.norm(places - places[tuple(here)], axis=2), CELL_M)
            to = np.array(np.unravel_index(np.argmax(left / away), left.shape))
        left.reshape(-1)[swept(to)] = 0.0
        flown += float(np.linalg.norm(places[tuple(to)] - places[tuple(here)]))
        here = to
        path.append(places[tuple(here)])
    return np.array(path)


def problem_of(information: DensityGrid, search: Search | None) -> Problem:
    """A quadrotor in the middle of the map, with time for the length."""
    return Problem(
        workspace=BOX,
        information=information,
        obstacles=ObstacleField.of(()),
        limits=Limits(SPEED_MPS, 3.0, 1.5, 3.0),
        start=Motion.at_rest(START_M),
        end_position_m=None,
        duration_s=LENGTH_M / SPEED_MPS,
        vehicle_radius_m=0.4,
        clearance_margin_m=1.0,
        search=search,
    )


@dataclasses.dataclass(frozen=True)
class Found:
    """How a contender did.

    Attributes:
        seen: Probability seen, of the box.
        seen_by_cells: The same counted by the middles of the map's own cells.
        length_m: Of its path.
        took_s: To find the path, warm.
    """

    seen: float
    seen_by_cells: float
    length_m: float = math.nan
    took_s: float = math.nan


def contenders(prior: DensityGrid, ground: Ground) -> Iterator[tuple[str, Found]]:
    """How each does, by name."""
    cells = Ground(prior)
    fine = prior.finer_on_the_map(RADIUS_M / 3.0)
    search = Search(fine, RADIUS_M, 1.0)
    effort = search.effort(LENGTH_M)
    flat = problem_of(prior, None)

    def timed(find: Callable[[], np.ndarray]) -> Found:
        began_s = time.perf_counter()
        path_m = find()
        took_s = time.perf_counter() - began_s
        return Found(ground.seen(path_m), cells.seen(path_m), min(LENGTH_M, length_of(path_m)), took_s)

    def best_spiral() -> np.ndarray:
        turns = [spiral(Region(flat), half / 2.0) for half in range(2, 80, 2)]
        ways = [Altitudes(flat).lifted(way, 0.5) for way in turns if length_of(way) >= LENGTH_M]
        return max((_about_the_middle(way, LENGTH_M) for way in ways), key=ground.seen)

    yield "best lawnmower", timed(lambda: Lawnmowers(flat, LENGTH_M).best(lambda path: -ground.seen(path))[1])
    yield "best spiral", timed(best_spiral)
    yield (
        "greedy to the next unseen cell, best of three",
        timed(lambda: max((greedy(prior, eagerness) for eagerness in EAGERNESS), key=ground.seen)),
    )
    yield "greedy step by step, from the peak", timed(lambda: greedy_steps(prior))
    options = Options(candidates=CANDIDATES, modes=MODES)
    for name, problem in (
        ("ergodic on the probability", flat),
        ("ergodic on the effort", problem_of(effort, None)),
        ("the product", problem_of(effort, search)),
    ):
        solve(problem, options)
        began_s = time.perf_counter()
        plan = solve(problem, options)
        took_s = time.perf_counter() - began_s
        # An ergodic plan is flown for its metric; the product's for what it finds.
        selected_m = _flown_m(plan.best)
        yield (
            f"{name}, selected",
            Found(ground.seen(selected_m), cells.seen(selected_m), length_of(selected_m), took_s),
        )
        paths = [_flown_m(one) for one in plan.candidates if one.feasible]
        medians = (float(np.median([where.seen(path) for path in paths])) for where in (ground, cells))
        yield f"{name}, median of {len(paths)}", Found(*medians)


def _flown_m(candidate: Candidate) -> np.ndarray:
    return candidate.trajectory.sampled_every(0.25).position_m


def _about_the_middle(way_m: np.ndarray, length_m: float) -> np.ndarray:
    """The inner part of a spiral, as long as asked."""
    legs = np.linalg.norm(np.diff(way_m, axis=0), axis=1)
    return at_lengths(way_m, legs, np.linspace(0.0, length_m, 4000))


def main() -> None:
    """Print a table a map."""
    print(machine())
    for path in [Path(name) for name in sys.argv[1:]] or [Path("examples/search_probability.npz")]:
        prior, share = prior_of(path)
        ground = Ground(prior.finer_on_the_map(RADIUS_M / 3.0))
        most = ground.most()
        print(f"\n{path.stem}: at most {most * share:.4f} of the whole map's probability, {most:.4f} of its middle's\n")
        print("| | found, of the whole map | of the most | length | solved in | found, by middles of cells |")
        print("|---|---|---|---|---|---|")
        for name, found in contenders(prior, ground):
            length, took = (
                "–" if math.isnan(figure) else f"{figure:.1f} {unit}"
                for figure, unit in ((found.length_m / 1000.0, "km"), (found.took_s, "s"))
            )
            row = f"{found.seen * share:.4f} | {100.0 * found.seen / most:.0f} % | {length} | {took}"
            print(f"| {name} | {row} | {found.seen_by_cells * share:.4f} |", flush=True)


if __name__ == "__main__":
    main()
