"""What a search finds: the product against what teams fly and against ergodic paths without a search in mind.

    python -m benchmarks.search [MAP.npz …]

Each map is a probability of where somebody is, in cells of 30 m (the example's own where none is given); the middle
3.6 km of it, 15 km of path, and a sensor that notices all it sees within 33 m. What is found is the probability of the
ground within that distance of the path, on cells of a third of it, so nothing is gained by passing over the middles of
cells. Hand-flown patterns know no acceleration and no start: they have every advantage.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from benchmarks.timing import machine
from planner.effort import Search
from planner.information import DensityGrid, raster
from planner.lawnmower import Lawnmowers
from planner.obstacles import ObstacleField
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
    """What a path has seen of it."""

    def __init__(self, prior: DensityGrid) -> None:
        fine = prior.finer_on_the_map(RADIUS_M / 3.0)
        self._mass = fine.mass.sum(axis=2).reshape(-1)
        self._places = fine.centers_m()[:, :, 0, :2].reshape(-1, 2)

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
    left = prior.mass.sum(axis=2).reshape(-1).copy()
    places = prior.centers_m()[:, :, 0, :2].reshape(-1, 2)
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


def contenders(prior: DensityGrid, ground: Ground) -> dict[str, tuple[float, float, float]]:
    """What each has seen, its length in metres, and the seconds its path took to find, warm."""
    found: dict[str, tuple[float, float, float]] = {}
    fine = prior.finer_on_the_map(RADIUS_M / 3.0)
    search = Search(fine, RADIUS_M, 1.0)
    effort = search.effort(LENGTH_M)
    flat = problem_of(prior, None)

    def note(name: str, path_m: np.ndarray, took_s: float) -> None:
        found[name] = ground.seen(path_m), min(LENGTH_M, length_of(path_m)), took_s

    began_s = time.perf_counter()
    _, rows = Lawnmowers(flat, LENGTH_M).best(lambda path: -ground.seen(path))
    note("best lawnmower", rows, time.perf_counter() - began_s)
    began_s = time.perf_counter()
    turns = [spiral(Region(flat), half / 2.0) for half in range(2, 80, 2)]
    ways = [Altitudes(flat).lifted(way, 0.5) for way in turns if length_of(way) >= LENGTH_M]
    tight = [_about_the_middle(way, LENGTH_M) for way in ways]
    note("best spiral", max(tight, key=ground.seen), time.perf_counter() - began_s)
    began_s = time.perf_counter()
    note(
        "greedy, best of three", max((greedy(prior, e) for e in EAGERNESS), key=ground.seen),
        time.perf_counter() - began_s,
    )  # fmt: skip
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
        paths = [one.trajectory.sampled_every(0.25).position_m for one in plan.candidates if one.feasible]
        # An ergodic plan is flown for its metric; the product's for what it finds.
        note(f"{name}, selected", plan.best.trajectory.sampled_every(0.25).position_m, took_s)
        median = float(np.median([ground.seen(path) for path in paths]))
        found[f"{name}, median of {len(paths)}"] = median, float("nan"), float("nan")
    return found


def _about_the_middle(way_m: np.ndarray, length_m: float) -> np.ndarray:
    """The inner part of a spiral, as long as asked."""
    legs = np.linalg.norm(np.diff(way_m, axis=0), axis=1)
    return at_lengths(way_m, legs, np.linspace(0.0, length_m, 4000))


def main() -> None:
    """Print a table a map."""
    print(machine())
    for path in [Path(name) for name in sys.argv[1:]] or [Path("examples/search_probability.npz")]:
        prior, share = prior_of(path)
        ground = Ground(prior)
        most = ground.most()
        print(f"\n{path.stem}: at most {most * share:.4f} of the whole map's probability, {most:.4f} of its middle's\n")
        print("| | found, of the whole map | of the most | length | solved in |\n|---|---|---|---|---|")
        for name, (seen, length_m, took_s) in contenders(prior, ground).items():
            length, took = (
                "–" if np.isnan(figure) else f"{figure:.{digits}f} {unit}"
                for figure, digits, unit in ((length_m / 1000.0, 1, "km"), (took_s, 1, "s"))
            )
            print(f"| {name} | {seen * share:.4f} | {100.0 * seen / most:.0f} % | {length} | {took} |", flush=True)


if __name__ == "__main__":
    main()
