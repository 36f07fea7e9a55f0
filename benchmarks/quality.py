"""How good the sets are on level targets, against the lawnmower.

python -m benchmarks.quality

Every length is measured on the curve itself, and the lawnmower is the best of all headings, row counts and insets at
exactly that length. The vehicle is all but unlimited in acceleration, as the papers' waypoints are.
"""

from __future__ import annotations

import dataclasses
import time

import numpy as np

from benchmarks.timing import machine
from planner.information import DensityGrid, uniform
from planner.judging import Judge, at_middles
from planner.obstacles import ObstacleField
from planner.plan import Plan
from planner.problem import Limits, MetricWeights, Options, Problem
from planner.solver import solve
from planner.trajectory import Motion
from planner.workspace import Workspace

FLAT = Workspace(np.zeros(3), np.array([1.0, 1.0, 0.1]))
CUBE = Workspace(np.zeros(3), np.ones(3))
DURATION_S = 100.0
ROWS = (4, 5, 6, 8)
FASTER = 1.15


def problem_of(workspace: Workspace, information: DensityGrid, length: float, start: np.ndarray) -> Problem:
    """A problem whose paths are at most so long."""
    speed = length / DURATION_S
    return Problem(
        workspace=workspace,
        information=information,
        obstacles=ObstacleField.of(()),
        limits=Limits(speed, speed, speed, 2.0 * speed),
        start=Motion.at_rest(start),
        end_position_m=None,
        duration_s=DURATION_S,
        vehicle_radius_m=0.0,
        clearance_margin_m=0.0,
    )


def length_of_rows(rows: int) -> float:
    """Of a lawnmower on the unit square."""
    return (rows - 1) + (rows - 1) / rows


def level_problem(workspace: Workspace, length: float, rows: int) -> Problem:
    """A uniform target, from where a lawnmower of so many rows begins."""
    start = np.full(3, 0.5 / rows) * workspace.lengths_m
    return problem_of(workspace, uniform(workspace, (32, 32, 8)), length, start)


def scores(plan: Plan, problem: Problem, options: Options) -> dict[str, float]:
    """The selected path's metric, by both conventions and on twice the modes, and its share of the lawnmower's."""
    curve = plan.best.trajectory
    middles = at_middles(curve).position_m
    finer = tuple(2 * count if count > 1 else 1 for count in options.modes)
    conventions = {
        "lin": dataclasses.replace(options, metric_weights=MetricWeights.LINEAR),
        "sq": dataclasses.replace(options, metric_weights=MetricWeights.SQUARED),
        "finer": dataclasses.replace(options, modes=finer, metric_weights=MetricWeights.LINEAR),
    }
    found = {name: Judge(problem, one).ergodic_metric(middles) for name, one in conventions.items()}
    return {
        **found,
        "length": plan.best.report.length_m,
        "ratio": plan.best.ergodic_metric / plan.lawnmower_ergodic_metric,
    }


def level() -> None:
    """Uniform targets in two and three dimensions."""
    print("\nlevel target, best of 12")
    print(f"{'problem':>24} {'length':>7} {'E(lin)':>9} {'E(sq)':>9} {'E(lin) 2K':>10} {'of lawnmower':>13} {'s':>6}")
    linear, squared = MetricWeights.LINEAR, MetricWeights.SQUARED
    cases = [(f"square, {rows} rows", FLAT, (8, 8, 1), length_of_rows(rows), rows, linear) for rows in ROWS]
    cases += [
        ("square, at most 5.3", FLAT, (8, 8, 1), 5.3, 5, linear),
        ("cube, at most 10", CUBE, (8, 8, 8), 10.0, 4, linear),
        ("cube, at most 10, by E(sq)", CUBE, (8, 8, 8), 10.0, 4, squared),
    ]
    for name, box, modes, length, rows, weights in cases:
        problem = level_problem(box, length, rows)
        if "at most" in name:
            # Speed enough to be as long as is allowed, starting and ending at rest.
            problem = dataclasses.replace(level_problem(box, FASTER * length, rows), max_length_m=length)
        options = Options(candidates=12, modes=modes, metric_weights=weights)
        solve(problem, options)
        started_s = time.perf_counter()
        plan = solve(problem, options)
        spent_s = time.perf_counter() - started_s
        row = scores(plan, problem, options)
        print(
            f"{name:>24} {row['length']:>7.2f} {row['lin']:>9.6f} {row['sq']:>9.6f} {row['finer']:>10.5f} "
            f"{row['ratio']:>13.3f} {spent_s:>6.2f}"
        )


def main() -> None:
    """Print the table."""
    print(machine())
    level()


if __name__ == "__main__":
    main()
