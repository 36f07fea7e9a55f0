"""How good the sets are: level and peaked targets, against the lawnmower and the papers' own optimisers.

python -m benchmarks.quality

Every length is measured on the curve itself, and the lawnmower is the best of all headings, row counts and insets at
exactly that length. The vehicle is all but unlimited in acceleration, as the papers' waypoints are.
"""

from __future__ import annotations

import dataclasses
import time

import numpy as np

from benchmarks.timing import machine
from planner.information import DensityGrid, gaussians, uniform
from planner.judging import Judge, at_middles
from planner.obstacles import ObstacleField
from planner.plan import Plan
from planner.problem import Kernel, Limits, Method, MetricWeights, Options, Problem
from planner.solver import solve
from planner.trajectory import Motion
from planner.workspace import Workspace

FLAT = Workspace(np.zeros(3), np.array([1.0, 1.0, 0.1]))
CUBE = Workspace(np.zeros(3), np.ones(3))
DURATION_S = 100.0
ROWS = (4, 5, 6, 8)
MIXTURES = 10


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
    cases = [(f"square, {rows} rows", FLAT, (8, 8, 1), (rows - 1) + (rows - 1) / rows, rows) for rows in ROWS]
    cases = [(name, box, modes, length, rows) for name, box, modes, length, rows in cases]
    cases += [("square, 5.3", FLAT, (8, 8, 1), 5.3, 5), ("cube, 10", CUBE, (8, 8, 8), 10.0, 4)]
    for name, box, modes, length, rows in cases:
        start = np.full(3, 0.5 / rows) * box.lengths_m
        problem = problem_of(box, uniform(box, (32, 32, 8)), length, start)
        options = Options(candidates=12, modes=modes)
        solve(problem, options)
        started_s = time.perf_counter()
        plan = solve(problem, options)
        spent_s = time.perf_counter() - started_s
        row = scores(plan, problem, options)
        print(
            f"{name:>24} {row['length']:>7.2f} {row['lin']:>9.6f} {row['sq']:>9.6f} {row['finer']:>10.5f} "
            f"{row['ratio']:>13.3f} {spent_s:>6.2f}"
        )


def peaked() -> None:
    """Random mixtures: medians over them of the best of eight, as a share of the lawnmower's."""
    print(f"\npeaked targets, {MIXTURES} random mixtures, best of 8: E of the selected over the lawnmower's (medians)")
    print(f"{'':>24} {'product':>9} {'identity':>9} {'SVES':>9} {'passed by SVES':>15}")
    for name, box, modes in (("square", FLAT, (8, 8, 1)), ("cube", CUBE, (8, 8, 8))):
        columns: dict[str, list[float]] = {"product": [], "identity": [], "sves": []}
        for seed in range(MIXTURES):
            rng = np.random.default_rng(seed)
            count = int(rng.integers(2, 5))
            mean = rng.uniform(0.15, 0.85, (count, 3)) * box.lengths_m
            std = rng.uniform(0.05, 0.15, (count, 3)) * box.lengths_m
            information = gaussians(box, mean, std, rng.uniform(0.3, 1.0, count), (64, 64, 32))
            problem = problem_of(box, information, 5.0, np.full(3, 0.1) * box.lengths_m)
            options = Options(candidates=8, modes=modes)
            for column, changed in (
                ("product", options),
                ("identity", dataclasses.replace(options, kernel=Kernel.IDENTITY)),
                ("sves", dataclasses.replace(options, method=Method.SVES, kernel=Kernel.RBF)),
            ):
                plan = solve(problem, changed)
                ratio = np.inf if plan.selected is None else plan.best.ergodic_metric / plan.lawnmower_ergodic_metric
                columns[column].append(ratio)
        passed = np.isfinite(columns["sves"]).sum()
        print(
            f"{name:>24} {np.median(columns['product']):>9.3f} {np.median(columns['identity']):>9.3f} "
            f"{np.median(columns['sves']):>9.3f} {passed:>12}/{MIXTURES}"
        )


def main() -> None:
    """Print the tables."""
    print(machine())
    level()
    peaked()


if __name__ == "__main__":
    main()
