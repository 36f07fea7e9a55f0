"""What `metric = "kernel"` in a mission file gives: the examples, solved under either metric, measured under both.

Warm: each is solved twice in this process and the second one counts, without its limit of time. A lawnmower is as long
as the path that was solved under the metric which it is measured by.

python -m benchmarks.kes.examples
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

from mission import load, plan
from mission.planning import Planned
from planner.judging import Judge, at_middles
from planner.problem import Metric

EXAMPLES = ("room", "forest", "city")
FOLDER = Path(__file__).parent.parent.parent / "examples"


def solved(example: str, metric: Metric) -> Planned:
    """The second of two solves."""
    mission = load(FOLDER / f"{example}.toml", [f"planner.metric={metric.value}", "planner.time_limit_s=600"])
    plan(mission)
    return plan(mission)


def measured(planned: Planned, metric: Metric) -> float:
    """E of the selected path under a metric."""
    judge = Judge(planned.problem, dataclasses.replace(planned.options, metric=metric))
    return judge.ergodic_metric(at_middles(planned.plan.best.trajectory).position_m)


def main() -> None:
    """Print the table."""
    print('\nKES: metric = "kernel" in the examples\n')
    print(
        "| example | metric | solver, warm | E(kernel) | over lawnmower's | E(spectral) | over lawnmower's | passed |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for example in EXAMPLES:
        found = {metric: solved(example, metric) for metric in Metric}
        for metric, planned in found.items():
            figures = {one: measured(planned, one) for one in Metric}
            cells = {
                one: (f"{figure:.4f}", f"{figure / found[one].plan.lawnmower_ergodic_metric:.2f}")
                for one, figure in figures.items()
            }
            passed = sum(candidate.feasible for candidate in planned.plan.candidates)
            print(
                f"| {example} | {metric.value} | {planned.solve_s:.2f} s | {' | '.join(cells[Metric.KERNEL])} "
                f"| {' | '.join(cells[Metric.SPECTRAL])} | {passed}/{len(planned.plan.candidates)} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
