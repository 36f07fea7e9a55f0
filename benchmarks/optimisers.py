"""What each part of the optimiser is worth: the same problem with one part taken away.

python -m benchmarks.optimisers
"""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Iterator
from unittest import mock

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.timing import machine
from mission import load
from mission.site.problem import options_from_mission, problem_from_mission
from planner import augmented_lagrangian, solver
from planner.problem import Kernel, Method


def _plain_scale(_scene: object, count: int, _penalty: object) -> jax.Array:
    """No frequency coordinates: every frequency moves a path as far as the slowest does."""
    return jnp.full((count, 3), (augmented_lagrangian.METRIC_CURVATURE / count) ** -0.5)


@contextlib.contextmanager
def _without(part: str) -> Iterator[None]:
    """Take a part of the optimiser away."""
    with contextlib.ExitStack() as stack:
        match part:
            case "frequency coordinates":
                stack.enter_context(mock.patch.object(augmented_lagrangian, "frequency_scale", _plain_scale))
            case "slow start of the penalties":
                firm = tuple(dataclasses.replace(one, penalty=10.0) for one in solver.POLISH)
                stack.enter_context(mock.patch.object(solver, "POLISH", firm))
            case "Stein steps":
                stack.enter_context(mock.patch.object(solver, "explored", lambda _scene, particles, *_: particles))
            case "half of the steps":
                half = tuple(dataclasses.replace(one, steps=one.steps // 2) for one in solver.POLISH)
                stack.enter_context(mock.patch.object(solver, "POLISH", half))
        jax.clear_caches()
        yield
    jax.clear_caches()


def main() -> None:
    """Print the table."""
    print(machine())
    print(f"{'example':>8} {'without':>28} {'best E':>8} {'median E':>9} {'passed':>7} {'plans':>6} {'warm s':>7}")
    for example in ("forest", "search", "city"):
        mission = load(f"examples/{example}.toml")
        problem, options = problem_from_mission(mission), options_from_mission(mission)
        parts = ("–", "frequency coordinates", "slow start of the penalties", "Stein steps", "half of the steps")
        for part in (*parts, "repulsion (identity)", "all of it (SVES as printed)"):
            chosen = options
            if part.startswith("repulsion"):
                chosen = dataclasses.replace(options, kernel=Kernel.IDENTITY)
            if part.startswith("all"):
                chosen = dataclasses.replace(options, method=Method.SVES, kernel=Kernel.RBF)
            with _without(part):
                solver.solve(problem, chosen)
                started_s = time.perf_counter()
                plan = solver.solve(problem, chosen)
                spent_s = time.perf_counter() - started_s
            passed = [candidate.ergodic_metric for candidate in plan.candidates if candidate.feasible]
            best, middle = (min(passed), np.median(passed)) if passed else (np.nan, np.nan)
            print(
                f"{example:>8} {part:>28} {best:>8.4f} {middle:>9.4f} {len(passed):>3}/{len(plan.candidates):<3} "
                f"{plan.diversity.effective_plans:>6.2f} {spent_s:>7.2f}"
            )


if __name__ == "__main__":
    main()
