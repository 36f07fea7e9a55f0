"""The product's own solver with each kernel: twelve candidates through the forest of `examples/forest.toml`.

Medians over four seeds; a first solve of each kernel compiles and is not counted. No lawnmower is fitted.

python -m benchmarks.sigsvgd.product_forest
"""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path

import numpy as np

from benchmarks.timing import without_baseline
from mission import load
from mission.site.problem import options_from_mission, problem_from_mission
from planner.problem import Kernel
from planner.solver import solve

FOREST = Path(__file__).parents[2] / "examples" / "forest.toml"
KERNELS = (Kernel.SIGNATURE, Kernel.RBF, Kernel.MARKOV, Kernel.IDENTITY)
CANDIDATES, SEEDS = 12, 4


def main() -> None:
    """Print the table."""
    mission = load(FOREST)
    problem = problem_from_mission(mission)
    options = dataclasses.replace(options_from_mission(mission), candidates=CANDIDATES)
    print("\nSigSVGD's kernel in the product: the forest, twelve candidates")
    print("| kernel | best E | median E | passed | distinct plans | mean pair distance | warm |")
    print("|---|---|---|---|---|---|---|")
    with without_baseline():
        for kernel in KERNELS:
            chosen = dataclasses.replace(options, kernel=kernel)
            solve(problem, chosen)
            rows = []
            for seed in range(SEEDS):
                started_s = time.perf_counter()
                plan = solve(problem, dataclasses.replace(chosen, seed=seed))
                spent_s = time.perf_counter() - started_s
                passed = [one.ergodic_metric for one in plan.candidates if one.feasible]
                spread = plan.diversity
                rows.append(
                    (
                        min(passed),
                        np.median(passed),
                        len(passed),
                        spread.effective_plans,
                        spread.mean_pair_distance,
                        spent_s,
                    )
                )
            best, middle, count, distinct, apart, spent_s = np.median(rows, axis=0)
            print(
                f"| {kernel.value} | {best:.4f} | {middle:.4f} | {count:.0f}/{CANDIDATES} | {distinct:.2f} "
                f"| {apart:.3f} | {spent_s:.2f} s |",
                flush=True,
            )


if __name__ == "__main__":
    main()
