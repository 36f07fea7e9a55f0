"""From a room to ten square kilometres: the same code, the time it takes, and what a similar mission compiles.

python -m benchmarks.scale

Each problem is solved twice in one process, then a similar one: a site with its obstacles and information elsewhere,
an example with one per cent less time. "Warm" is the second solve; "compiled anew" is what the similar one compiled.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.timing import machine
from mission.loading import load
from mission.planning import CompileTime, keep_compiled
from mission.site.problem import options_from_mission, problem_from_mission
from planner.information import gaussians
from planner.obstacles import Box, Cylinder, Obstacle, ObstacleField, Prism, Sphere
from planner.plan import Plan
from planner.problem import Limits, Options, Problem
from planner.solver import solve
from planner.trajectory import Motion
from planner.workspace import Workspace

EXAMPLES = Path(__file__).parents[1] / "examples"
Make = Callable[[int], Problem]


def example(name: str) -> tuple[Make, Options]:
    """A mission of examples/, and versions of it that differ a little."""
    mission = load(EXAMPLES / f"{name}.toml")
    problem = problem_from_mission(mission)

    def make(seed: int) -> Problem:
        return dataclasses.replace(problem, duration_s=problem.duration_s * (1.0 - 0.01 * seed))

    return make, options_from_mission(mission)


def site(lengths_m: tuple[float, float, float], limits: Limits, duration_s: float, keep_out_m: float) -> Make:
    """Six hills of probability among twenty obstacles, up to a tenth of the site wide; a tour back to the start."""

    def make(seed: int) -> Problem:
        rng = np.random.default_rng(seed)
        box = Workspace(np.zeros(3), np.array(lengths_m))
        mean = rng.uniform(0.12, 0.88, (6, 3)) * lengths_m
        std = rng.uniform(0.04, 0.14, (6, 3)) * lengths_m
        information = gaussians(box, mean, std, rng.uniform(0.3, 1.0, 6), (128, 128, 16))
        start = 0.03 * np.array(lengths_m)
        start[2] = 0.25 * lengths_m[2]
        shapes: list[Obstacle] = []
        while len(shapes) < 20:
            center, radius = rng.uniform(0.06, 0.94, 3) * lengths_m, rng.uniform(0.01, 0.04) * lengths_m[0]
            if np.linalg.norm(center[:2] - start[:2]) < radius + 0.03 * lengths_m[0]:
                continue
            half = np.array([radius, radius, 0.3 * lengths_m[2]])
            shapes.append(
                (
                    Cylinder(center[:2], radius, 0.0, rng.uniform(0.5, 1.2) * lengths_m[2]),
                    Sphere(center, radius),
                    Box(center - half, center + half),
                )[len(shapes) % 3]
            )
        return Problem(
            workspace=box,
            information=information,
            obstacles=ObstacleField.of(shapes),
            limits=limits,
            start=Motion.at_rest(start),
            end_position_m=start,
            duration_s=duration_s,
            vehicle_radius_m=0.5,
            clearance_margin_m=keep_out_m,
        )

    return make


def town(buildings: int, trees: int) -> Make:
    """Two square kilometres of buildings and trees, flown between and over; most of it is as high as the flight."""

    def make(seed: int) -> Problem:
        rng = np.random.default_rng(seed)
        lengths_m = np.array([1600.0, 1250.0, 60.0])
        start = np.array([15.0, 15.0, 30.0])
        mean, std = rng.uniform(0.15, 0.85, (5, 3)) * lengths_m, rng.uniform(0.05, 0.12, (5, 3)) * lengths_m
        shapes: list[Obstacle] = []
        while len(shapes) < buildings + trees:
            center = rng.uniform(0.0, 1.0, 2) * lengths_m[:2]
            if np.linalg.norm(center - start[:2]) < 25.0:
                continue
            if len(shapes) < buildings:
                east, north = rng.uniform(5.0, 12.0, 2)
                corners = np.array(
                    [[-east, -north], [east, -north], [east, north], [0.0, north], [0.0, 0.0], [-east, 0.0]]
                )
                turn = rng.uniform(0.0, np.pi)
                turned = corners @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
                shapes.append(Prism(center + turned, 0.0, rng.uniform(6.0, 45.0)))
            else:
                shapes.append(Cylinder(center, rng.uniform(1.0, 4.0), 0.0, rng.uniform(5.0, 25.0)))
        return Problem(
            workspace=Workspace(np.zeros(3), lengths_m),
            information=gaussians(Workspace(np.zeros(3), lengths_m), mean, std, np.ones(5), (128, 128, 8)),
            obstacles=ObstacleField.of(shapes),
            limits=Limits(10.0, 3.0, 2.0, 3.0),
            start=Motion.at_rest(start),
            end_position_m=start,
            duration_s=900.0,
            vehicle_radius_m=0.5,
            clearance_margin_m=2.0,
        )

    return make


def cases() -> dict[str, tuple[Make, Options]]:
    """Name → problems and options."""
    room, room_options = example("room")
    forest, forest_options = example("forest")
    field = site((500.0, 500.0, 60.0), Limits(8.0, 3.0, 2.0, 3.0), 1200.0, 3.0)
    county = site((3200.0, 3200.0, 80.0), Limits(15.0, 4.0, 3.0, 4.0), 1200.0, 5.0)
    return {
        "room": (room, room_options),
        "forest, twelve candidates": (forest, dataclasses.replace(forest_options, candidates=12)),
        "field, T=600, 32×32×4": (field, Options(candidates=16, modes=(32, 32, 4), time_step_s=2.0)),
        "field, its own knots": (field, Options(candidates=16, modes=(32, 32, 4))),
        "town, 1000 buildings, 1000 trees": (town(1000, 1000), Options(candidates=8, modes=(24, 20, 1))),
        "10 km², 32×32": (county, Options(candidates=8, modes=(32, 32, 1))),
    }


def timed(problem: Problem, options: Options) -> tuple[Plan, float, float]:
    """A solve, its seconds, and those of them that the compiler took."""
    with CompileTime() as compiling:
        started_s = time.perf_counter()
        plan = solve(problem, options)
        return plan, time.perf_counter() - started_s, compiling.spent_s


def main() -> None:
    """Print the table."""
    print(machine())
    print("\n| problem | first | warm | similar | compiled anew | passed | E / lawnmower's | worst / best | distinct |")
    print("|---|---|---|---|---|---|---|---|---|")
    keep_compiled()
    for name, (make, options) in cases().items():
        _, first_s, _ = timed(make(0), options)
        plan, warm_s, _ = timed(make(0), options)
        _, similar_s, compiled_s = timed(make(1), options)
        metrics = [candidate.ergodic_metric for candidate in plan.candidates]
        passed = sum(candidate.feasible for candidate in plan.candidates)
        print(
            f"| {name} | {first_s:.1f} s | {warm_s:.2f} s | {similar_s:.2f} s | {compiled_s:.1f} s "
            f"| {passed}/{len(metrics)} | {plan.best.ergodic_metric / plan.lawnmower_ergodic_metric:.2f} "
            f"| {max(metrics) / min(metrics):.2f} | {plan.diversity.effective_plans:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
