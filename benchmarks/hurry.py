"""What a plan is worth when there is less time for it than it takes.

The same problem under ever shorter limits, beside the seeds alone (no time at all). All of it compiled before.

    python -m benchmarks.hurry
"""

from __future__ import annotations

import dataclasses
import math
import time

import numpy as np

from benchmarks.timing import machine
from mission import load
from mission.planning import keep_compiled
from mission.site.problem import options_from_mission, problem_from_mission
from planner.plan import Plan
from planner.problem import Options, Problem
from planner.solver import solve

REPEATS = 3
# Example, candidates (None: as many as it asks for), limits in seconds.
CASES = (
    ("forest", None, (0.3, 0.4, 0.5, 0.7, 1.0, math.inf)),
    ("city", None, (1.5, 2.0, 2.5, 3.0, 4.0, math.inf)),
    ("forest", 200, (5.0, 10.0, 20.0, math.inf)),
)


def main() -> None:
    """Print the table."""
    keep_compiled()
    print(machine())
    print("\n| example | candidates | limit | took | steps | passed | E of the selected | median E |")
    print("|---|---|---|---|---|---|---|---|")
    for name, candidates, limits in CASES:
        mission = load(f"examples/{name}.toml")
        problem, options = problem_from_mission(mission), options_from_mission(mission)
        if candidates is not None:
            options = dataclasses.replace(options, candidates=candidates)
        solve(problem, options)
        for limit_s in (0.0, *limits):
            runs = sorted((within(problem, options, limit_s) for _ in range(REPEATS)), key=lambda run: run[0])
            took_s, plan = runs[REPEATS // 2]
            metrics = [one.ergodic_metric for one in plan.candidates if one.feasible]
            shown = "none" if math.isinf(limit_s) else "seeds" if limit_s == 0.0 else f"{limit_s:g} s"
            print(
                f"| {name} | {len(plan.candidates)} | {shown} | {took_s:.2f} s | {plan.steps} | "
                f"{len(metrics)}/{len(plan.candidates)} | {min(metrics, default=math.nan):.4f} | "
                f"{np.median(metrics) if metrics else math.nan:.4f} |",
                flush=True,
            )


def within(problem: Problem, options: Options, limit_s: float) -> tuple[float, Plan]:
    """A solve that is given so long, and how long it took."""
    started_s = time.perf_counter()
    plan = solve(problem, options, time_left_s=lambda: started_s + limit_s - time.perf_counter())
    return time.perf_counter() - started_s, plan


if __name__ == "__main__":
    main()
