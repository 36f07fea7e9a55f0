"""One world: planned by the product, tried with the simple tours, every curve confirmed."""

from __future__ import annotations

import dataclasses
import tempfile
import time
from pathlib import Path

from benchmarks.timing import without_baseline
from benchmarks.worlds.confirming import confirmed
from benchmarks.worlds.drawn import World, WorldClass, draw
from benchmarks.worlds.simple_tours import first_feasible, lawnmowers, straight_lines
from mission.planning import CompileTime
from planner.solver import solve
from planner.trajectory import Trajectory


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What became of a world.

    Attributes:
        seed: Draws the world again.
        kind: Its class.
        width_m: Its longer side.
        obstacles: How many bodies stand in it.
        candidates: How many were asked for.
        planned: Whether the product has something to fly.
        passed: How many candidates the gate passed.
        straight: Whether a straight line is feasible.
        rows: Whether a lawnmower is.
        around: Whether either is, once led around what is in the way.
        unsound: What the checker found in curves that the gate had passed.
        why: Of what the gate refused the first candidate, where nothing was planned.
        warm_s: The solve, less what the compiler took.
        checked: Curves shown to the checker.
    """

    seed: int
    kind: WorldClass
    width_m: float
    obstacles: int
    candidates: int
    planned: bool
    passed: int
    straight: bool
    rows: bool
    around: bool
    unsound: tuple[str, ...]
    why: str
    warm_s: float
    checked: int

    @property
    def simple(self) -> bool:
        """Whether a straight line or a lawnmower is feasible."""
        return self.straight or self.rows


def tried(seed: int) -> Outcome:
    """Plan the world of a seed, and try the simple tours in it."""
    with tempfile.TemporaryDirectory() as folder:
        return _tried(draw(seed, Path(folder)))


def _tried(world: World) -> Outcome:
    problem = world.problem
    with without_baseline(), CompileTime() as compiling:
        started_s = time.perf_counter()
        plan = solve(problem, world.options)
        warm_s = time.perf_counter() - started_s - compiling.spent_s
    line = first_feasible(problem, straight_lines(problem), led_around=False)
    rows = first_feasible(problem, lawnmowers(problem), led_around=False)
    around = line or rows or first_feasible(problem, straight_lines(problem), led_around=True)
    curves: dict[str, Trajectory] = {
        f"candidate {index}": candidate.trajectory
        for index, candidate in enumerate(plan.candidates)
        if candidate.feasible
    }
    curves |= {name: curve for name, curve in (("line", line), ("rows", rows), ("around", around)) if curve is not None}
    unsound = [f"{name}: {fault}" for name, curve in curves.items() for fault in confirmed(world, curve).faults]
    refused = [candidate.report.violations[0].text for candidate in plan.candidates if not candidate.feasible]
    return Outcome(
        seed=world.seed,
        kind=world.kind,
        width_m=float(problem.workspace.lengths_m[0]),
        obstacles=world.obstacles,
        candidates=world.options.candidates,
        planned=plan.selected is not None,
        passed=sum(candidate.feasible for candidate in plan.candidates),
        straight=line is not None,
        rows=rows is not None,
        around=around is not None,
        unsound=tuple(unsound),
        why="; ".join(refused) if plan.selected is None else "",
        warm_s=warm_s,
        checked=len(curves),
    )
