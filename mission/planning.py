"""From a mission to a plan: the one file that speaks both vocabularies and owns the solver's clock."""

from __future__ import annotations

import dataclasses
import os
import time
from collections.abc import Callable
from pathlib import Path

import jax

from mission.mission_file import Mission
from mission.site.problem import options_from_mission, problem_from_mission
from planner.plan import Plan
from planner.problem import Options, Problem
from planner.solver import Progress, solve

COMPILE_EVENTS = (
    "/jax/core/compile/jaxpr_trace_duration",
    "/jax/core/compile/jaxpr_to_mlir_module_duration",
    "/jax/core/compile/backend_compile_duration",
)
"""The parts of a compilation, one after the other; reading it from the cache counts to the last."""


@dataclasses.dataclass(frozen=True)
class Planned:
    """A mission with its plan.

    Attributes:
        mission: What was asked for.
        problem: The same, as the planner was given it.
        options: How it was solved.
        plan: What came out.
        solve_s: Time in the solver, compilation aside: what `planner.time_limit_s` limits.
        total_s: Time from the mission to the plan, with making the arrays and compiling.
        compile_s: Time in which the solver was compiled; little where that was done before.
    """

    mission: Mission
    problem: Problem
    options: Options
    plan: Plan
    solve_s: float
    total_s: float
    compile_s: float = 0.0


def plan(mission: Mission, *, progress: Callable[[Progress], None] = lambda _: None) -> Planned:
    """Solve a mission.

    Args:
        mission: As `mission.load` gives it.
        progress: Told now and then how far the solve is.

    Returns:
        The plan; `plan.status` says whether there is something to fly.

    Raises:
        ValueError: A file that the mission names changed since it was checked.
    """
    keep_compiled()
    started_s = time.monotonic()
    problem, options = problem_from_mission(mission), options_from_mission(mission)
    solving_s = time.monotonic()
    with CompileTime() as compiling:
        deadline_s = solving_s + mission.planner.time_limit_s
        found = solve(
            problem,
            options,
            progress=progress,
            time_left_s=lambda: deadline_s + compiling.spent_s - time.monotonic(),
        )
    ended_s = time.monotonic()
    return Planned(
        mission,
        problem,
        options,
        found,
        solve_s=ended_s - solving_s - compiling.spent_s,
        total_s=ended_s - started_s,
        compile_s=compiling.spent_s,
    )


class CompileTime:
    """How long JAX has been compiling since this was entered: the first solve of its size is not cut short by it."""

    spent_s = 0.0

    def __enter__(self) -> CompileTime:
        jax.monitoring.register_event_duration_secs_listener(self._listen)
        return self

    def __exit__(self, *_: object) -> None:
        jax.monitoring.unregister_event_duration_listener(self._listen)

    def _listen(self, event: str, duration_secs: float, **_: str | int) -> None:
        if event in COMPILE_EVENTS:
            self.spent_s += duration_secs


def keep_compiled() -> None:
    """Keep what JAX compiles from one run to the next, in the user's cache folder."""
    if jax.config.values["jax_compilation_cache_dir"] is None:
        cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ergonaut" / "jax"
        jax.config.update("jax_compilation_cache_dir", str(cache))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.2)
