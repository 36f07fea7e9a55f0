"""What each part of the optimiser is worth: the same problem with one part taken away, or another in its place.

python -m benchmarks.optimisers
"""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Callable, Iterable, Iterator
from unittest import mock

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.inner_solvers import adam_init, adam_step, gauss_newton_step
from benchmarks.timing import machine, without_baseline
from mission import load
from mission.site.problem import options_from_mission, problem_from_mission
from planner import augmented_lagrangian, lbfgs, polish, solver
from planner.plan import Plan
from planner.polish import Particles, Round, polished
from planner.problem import Kernel, Method, Options, Problem
from planner.scene import Scene, knots_for
from planner.spectral_metric import SpectralMetric

SCHEDULES = ("POLISH", "SHAPE_POLISH", "SEARCH_POLISH")
SOFT = 0.1
WANTED = 1.5
"""The E whose moment is told, as a multiple of what the product's own best comes to."""


def _plain_scale(_scene: object, count: int, _penalty: object) -> jax.Array:
    """No frequency coordinates: every frequency moves a path as far as the slowest does."""
    return jnp.full((count, 3), (augmented_lagrangian.METRIC_CURVATURE / count) ** -0.5)


def _coarse_to_fine(
    scene: Scene, particles: Particles, rounds: Iterable[Round], after_round: Callable[[float], None]
) -> tuple[Particles, int]:
    """The soft rounds on half of the modes an axis, the others on all; what a search finds has no modes."""
    if not isinstance(scene.metric, SpectralMetric):
        return polished(scene, particles, rounds, after_round)
    rounds = list(rounds)
    soft = [one for one in rounds if one.penalty < SOFT]
    weights = np.array(scene.metric.weights)
    for axis, count in enumerate(weights.shape):
        np.moveaxis(weights, axis, 0)[-(-count // 2) :] = 0.0
    coarse = eqx.tree_at(lambda one: one.metric.weights, scene, jnp.asarray(weights))
    particles, begun = polished(coarse, particles, soft, after_round)
    particles, taken = polished(scene, particles, rounds[len(soft) :], after_round)
    return particles, begun + taken


def _knot_a_sample(problem: Problem, options: Options) -> tuple[int, int]:
    """As many knots as the metric has samples: dense points, as good as."""
    segments, per_segment = knots_for(problem, options)
    return segments * per_segment, 1


@contextlib.contextmanager
def _changed(part: str) -> Iterator[None]:
    """Take a part of the optimiser away, or put another in its place."""
    with contextlib.ExitStack() as stack:

        def put(room: object, name: str, value: object) -> None:
            stack.enter_context(mock.patch.object(room, name, value))

        def put_rounds(change: Callable[[Round], Round]) -> None:
            for name in SCHEDULES:
                put(solver, name, tuple(map(change, getattr(solver, name))))

        match part:
            case "without frequency coordinates":
                put(augmented_lagrangian, "frequency_scale", _plain_scale)
            case "without a slow start of the penalties":
                put_rounds(lambda one: dataclasses.replace(one, penalty=10.0))
            case "without Stein steps":
                put(solver, "explored", lambda _scene, particles, *_: (particles, 0))
            case "with half of the steps":
                put_rounds(lambda one: dataclasses.replace(one, steps=one.steps // 2))
            case "with Adam":
                put(lbfgs, "init", adam_init)
                put(lbfgs, "step", adam_step)
            case "with Gauss–Newton":
                put(augmented_lagrangian, "step", gauss_newton_step)
                # Its linear systems are LAPACK's, which no parts at once may call (`polish._each`).
                put(polish, "cores", lambda: 1)
            case "with half of the modes first":
                put(solver, "polished", _coarse_to_fine)
            case "with a knot a sample":
                put(solver, "knots_for", _knot_a_sample)
        jax.clear_caches()
        yield
    jax.clear_caches()


PARTS = (
    "–",
    "without frequency coordinates",
    "without a slow start of the penalties",
    "without Stein steps",
    "without repulsion (identity)",
    "with half of the steps",
    "with half of the modes first",
    "with a knot a sample",
    "with Adam",
    "with Gauss–Newton",
    "SVES as printed",
)


@dataclasses.dataclass
class Course:
    """How a solve went on.

    Attributes:
        moments: Seconds since its beginning, and the lowest E of the set then, which may still break limits.
    """

    moments: list[tuple[float, float]] = dataclasses.field(default_factory=list)

    def first_s(self, metric: float) -> float:
        """When the set first had this E; NaN: never."""
        return next((at_s for at_s, lowest in self.moments if lowest <= metric), float("nan"))


def solved(problem: Problem, options: Options) -> tuple[Plan, Course, float]:
    """A warm solve, its course and its seconds."""
    solver.solve(problem, options)
    course, started_s = Course(), time.perf_counter()

    def note(progress: solver.Progress) -> None:
        if progress.best_ergodic_metric is not None:
            course.moments.append((time.perf_counter() - started_s, progress.best_ergodic_metric))

    plan = solver.solve(problem, options, progress=note)
    return plan, course, time.perf_counter() - started_s


def main() -> None:
    """Print the table."""
    print(machine())
    print("| example | changed | time to E | best E | median E | passed | distinct plans | warm |")
    print("|---|---|---|---|---|---|---|---|")
    for example in ("forest", "search", "city"):
        mission = load(f"examples/{example}.toml")
        problem, options = problem_from_mission(mission), options_from_mission(mission)
        wanted = float("nan")
        for part in PARTS:
            if part == "with Gauss–Newton" and example != "forest":
                # A step of it costs more than a hundred gradients: minutes, where there are many modes and knots.
                continue
            chosen = options
            if part.startswith("without repulsion"):
                chosen = dataclasses.replace(options, kernel=Kernel.IDENTITY)
            if part.startswith("SVES"):
                chosen = dataclasses.replace(options, method=Method.SVES, kernel=Kernel.RBF)
            with _changed(part), without_baseline():
                plan, course, spent_s = solved(problem, chosen)
            passed = [candidate.ergodic_metric for candidate in plan.candidates if candidate.feasible]
            best, middle = (min(passed), np.median(passed)) if passed else (np.nan, np.nan)
            if part == PARTS[0]:
                wanted = WANTED * best
            reached_s = course.first_s(wanted)
            reached = "never" if np.isnan(reached_s) else f"{reached_s:.2f} s"
            print(
                f"| {example} | {part} | {reached} | {best:.4f} | {middle:.4f} | {len(passed)}/{len(plan.candidates)} "
                f"| {plan.diversity.effective_plans:.2f} | {spent_s:.1f} s |",
                flush=True,
            )


if __name__ == "__main__":
    main()
