"""Coverage: paths that are optimised under one metric, measured under both.

Taken: random mixtures of two to four peaks in the unit square and cube, the product's solver for both metrics, best of
four, T = 100 s; the lawnmower is the best of all of its length, chosen for each metric anew.

python -m benchmarks.kes.coverage
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.claims import print_claims
from benchmarks.kes.report import save
from benchmarks.peaked import mixture
from benchmarks.quality import CUBE, FLAT, problem_of
from benchmarks.timing import without_baseline
from planner.judging import Judge, at_middles
from planner.lawnmower import Lawnmowers
from planner.problem import Metric, Options
from planner.solver import solve

SEEDS, CANDIDATES = 8, 4
CASES = {"square": (FLAT, (8, 8, 1), 5.5), "cube": (CUBE, (8, 8, 8), 7.0)}


@dataclasses.dataclass(frozen=True)
class Outcome:
    """Of one target and one metric that was optimised.

    Attributes:
        metrics: E of the path under each metric.
        lawnmowers: E of the best lawnmower of its length under each metric.
        solve_s: Time of the solve.
        path: Unit cube, shape (time, 3).
    """

    metrics: dict[Metric, float]
    lawnmowers: dict[Metric, float]
    solve_s: float
    path: np.ndarray


def outcome(case: str, seed: int, optimised: Metric) -> Outcome:
    """Solve under one metric, measure under both."""
    box, modes, length = CASES[case]
    problem = problem_of(box, mixture(box, seed), length, np.full(3, 0.1) * box.lengths_m)
    options = Options(candidates=CANDIDATES, modes=modes, metric=optimised)
    with without_baseline():
        started_s = time.perf_counter()
        plan = solve(problem, options)
        solve_s = time.perf_counter() - started_s
    middles = at_middles(plan.best.trajectory).position_m
    rows = Lawnmowers(problem, plan.best.report.length_m)
    judges: dict[Metric, Callable[..., float]] = {
        one: Judge(problem, dataclasses.replace(options, metric=one)).ergodic_metric for one in Metric
    }
    return Outcome(
        {one: judge(middles) for one, judge in judges.items()},
        {one: rows.best(judge)[0] for one, judge in judges.items()},
        solve_s,
        box.unit_from_enu(middles),
    )


def main() -> None:
    """Print and draw."""
    rows, verdicts = [], []
    figure, plots = plt.subplots(1, 2, figsize=(6.5, 3.2))
    for case in CASES:
        found: dict[Metric, list[Outcome]] = {}
        for optimised in Metric:
            outcome(case, 0, optimised)  # Compiles.
            found[optimised] = [outcome(case, seed, optimised) for seed in range(SEEDS)]

        def over(optimised: Metric, measured: Metric, found: dict[Metric, list[Outcome]] = found) -> float:
            return float(np.median([one.metrics[measured] / one.lawnmowers[measured] for one in found[optimised]]))

        for optimised in Metric:
            rows.append(
                f"{case}, optimised under {optimised.value}: of the lawnmower's E "
                + ", ".join(f"{over(optimised, measured):.3f} ({measured.value})" for measured in Metric)
                + f"; {np.median([one.solve_s for one in found[optimised]]):.1f} s"
            )
        price = {
            measured: float(
                np.median(
                    [
                        theirs.metrics[measured] / own.metrics[measured]
                        for theirs, own in zip(found[other], found[measured], strict=True)
                    ]
                )
            )
            for measured, other in ((Metric.SPECTRAL, Metric.KERNEL), (Metric.KERNEL, Metric.SPECTRAL))
        }
        better = sum(one.metrics[Metric.SPECTRAL] < one.lawnmowers[Metric.SPECTRAL] for one in found[Metric.KERNEL])
        verdicts.append(
            f"{case}: kernel paths beat the lawnmower under the spectral metric in {better} of {SEEDS}; they have "
            f"{price[Metric.SPECTRAL]:.1f} times the spectral E of spectral paths, and those "
            f"{price[Metric.KERNEL]:.2f} times the kernel E of kernel paths"
        )
        if case == "square":
            for plot, optimised in zip(plots, Metric, strict=True):
                plot.imshow(mixture(FLAT, 0).mass.sum(axis=2).T, origin="lower", extent=(0, 1, 0, 1), cmap="Blues")
                plot.plot(*found[optimised][0].path[:, :2].T, color="tab:red", linewidth=1.0)
                plot.set(title=f"optimised under {optimised.value}", xticks=[], yticks=[])
                plot.title.set_fontsize(9)
    print_claims(
        "KES: coverage",
        [("coverage as good as the Fourier metric's", "\n         ".join(rows), "\n         ".join(verdicts))],
    )
    save(figure, "coverage")


if __name__ == "__main__":
    main()
