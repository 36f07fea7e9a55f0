"""How many Stein steps, and how long: the same solves from the same seeds, under other schedules.

python -m benchmarks.annealing

The best E of a set is a local optimum and jumps between sets of seeds by more than schedules differ, so each schedule
solves from many, and its best E is compared with the product's set by set.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from unittest import mock

import jax
import numpy as np

from benchmarks.quality import FLAT, length_of_rows, level_problem
from benchmarks.timing import machine, without_baseline
from mission import load
from mission.site.problem import options_from_mission, problem_from_mission
from planner import polish, solver
from planner.problem import Options, Problem
from planner.solver import solve
from planner.stein import Annealing

SETS = 24
CANDIDATES = 12
ROWS = (4, 5, 6)
SCHEDULES = (polish.ANNEALING, Annealing(6, 0.15, 0.003), Annealing(8, 0.1, 0.003), Annealing(20, 0.06, 0.003))


def problems() -> Iterator[tuple[str, Problem, Options]]:
    """Level squares with the length of a lawnmower, and two of the examples, twelve candidates each."""
    for rows in ROWS:
        problem = level_problem(FLAT, length_of_rows(rows), rows)
        yield f"square, {rows} rows", problem, Options(candidates=CANDIDATES, modes=(8, 8, 1))
    for example in ("room", "forest"):
        mission = load(f"examples/{example}.toml")
        options = dataclasses.replace(options_from_mission(mission), candidates=CANDIDATES)
        yield example, problem_from_mission(mission), options


def figures_of(problem: Problem, options: Options, schedule: Annealing) -> np.ndarray:
    """A row a set of seeds: best, median and worst E of those that passed, their number, distinct plans among them."""
    # The schedule is read where the Stein phase is traced.
    jax.clear_caches()
    rows = []
    with (
        without_baseline(),
        mock.patch.object(polish, "ANNEALING", schedule),
        mock.patch.object(solver, "ANNEALING", schedule),
    ):
        for seed in range(SETS):
            plan = solve(problem, dataclasses.replace(options, seed=seed))
            passed = [candidate.ergodic_metric for candidate in plan.candidates if candidate.feasible]
            rows.append((min(passed), np.median(passed), max(passed), len(passed), plan.diversity.effective_plans))
    return np.array(rows)


def main() -> None:
    """Print the table."""
    print(machine())
    print(
        f"\n{SETS} sets of {CANDIDATES} seeds: geometric means of E, means of the rest; by the product's: set by set\n"
    )
    print("| problem | steps, first, last | best E | by the product's | median E | worst / best | passed | distinct |")
    print("|---|---|---|---|---|---|---|---|")
    for name, problem, options in problems():
        product = figures_of(problem, options, polish.ANNEALING)
        for schedule in SCHEDULES:
            found = product if schedule is polish.ANNEALING else figures_of(problem, options, schedule)
            over = np.log(found[:, 0] / product[:, 0])
            best, middle, worst = np.exp(np.log(found[:, :3]).mean(axis=0))
            passed, distinct = found[:, 3:].mean(axis=0)
            print(
                f"| {name} | {schedule.steps}, {schedule.longest_unit}, {schedule.shortest_unit} | {best:.5f} "
                f"| {np.exp(over.mean()):.3f} ± {over.std() / np.sqrt(SETS):.3f} | {middle:.5f} "
                f"| {worst / best:.2f} | {passed:.1f} | {distinct:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
