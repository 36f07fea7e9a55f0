"""From a problem to a set of proven, different paths (SVES Alg. 1, then a polish of each candidate).

seeds → Stein steps, together → rounds of multipliers, each on its own → gate → selection.

The caller owns the clock: `out_of_time` is asked between the compiled pieces, and the best proven set so far returns.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from planner import augmented_lagrangian, stein, sves
from planner.diversity import diversity
from planner.judging import Judge, at_middles, better
from planner.lawnmower import lawnmower_ergodic_metric
from planner.plan import Candidate, Plan, Status
from planner.problem import Kernel, Method, Options, Problem
from planner.scene import Scene, free_from_control, knots_for, scene_of, trajectory_of
from planner.seeds import seed_paths, spline_from_path
from planner.selection import select
from planner.sves import Refinement
from planner.trajectory import Trajectory

STEIN_STEPS = 60
# The Stein phase may cut corners; the polish makes them good.
STEIN_PENALTY = 0.1
# Geometric from nearly free to firm: starting firm freezes a path in the shape of its seed.
POLISH_PENALTIES = tuple(np.geomspace(1e-3, 10.0, 12))
# A replan starts from an answer: its multipliers need no slow start.
WARM_POLISH_PENALTIES = (1.0, 3.0, 10.0)
REPAIR_PENALTIES = (30.0, 100.0, 300.0)
STEPS_PER_ROUND = 30
SMOOTHNESS_WEIGHT = 1e-3


@dataclasses.dataclass(frozen=True)
class Progress:
    """How far a solve is.

    Attributes:
        phase: What it does: "seeds", "stein", "polish", "repair", "gate".
        done: Share of the whole work, 0 … 1.
        best_ergodic_metric: Lowest E so far; None before the first round.
    """

    phase: str
    done: float
    best_ergodic_metric: float | None = None


def solve(
    problem: Problem,
    options: Options,
    *,
    warm_start: Sequence[Trajectory] = (),
    progress: Callable[[Progress], None] = lambda _: None,
    out_of_time: Callable[[], bool] = lambda: False,
) -> Plan:
    """Find a set of different paths, prove them, and select one.

    Args:
        problem: What to explore.
        options: How to solve it.
        warm_start: Earlier candidates, each beginning at its own start time; they take the first places of the set,
            and seeds fill the rest.
        progress: Told now and then how far the solve is.
        out_of_time: Asked between compiled pieces; once it says yes, what there is goes to the gate.

    Returns:
        The plan; its status says whether there is something to fly.
    """
    progress(Progress("seeds", 0.0))
    segments, per_segment = knots_for(problem, options)
    scene = scene_of(problem, options, segments, per_segment)
    patterns, seeds = _starting_set(problem, options, segments, warm_start)
    judge = Judge(problem, options)

    def judged(free: Float[np.ndarray, "particle free 3"]) -> list[Candidate]:
        sound = np.where(np.isfinite(free).all(axis=(1, 2), keepdims=True), free, seeds)
        curves = [trajectory_of(problem, points) for points in sound]
        return [judge.candidate(curve, pattern) for curve, pattern in zip(curves, patterns, strict=True)]

    best, steps = judged(seeds), 0
    match options.method:
        case Method.DEFAULT:
            refined = _polished(scene, seeds, options, bool(warm_start), progress, out_of_time)
        case Method.SVES:
            refined = sves.refined(scene, seeds, options, out_of_time)
    for refinement in refined:
        steps = refinement.steps
        # Of each candidate the better version stays, so none ends worse than the seed it grew from.
        pairs = zip(best, judged(refinement.free), strict=True)
        best = [better(known, new) for known, new in pairs]
        if all(candidate.feasible for candidate in best):
            break
    progress(Progress("gate", 0.95))
    return _plan(problem, options, judge, best, steps, out_of_time())


def _starting_set(
    problem: Problem, options: Options, segments: int, warm_start: Sequence[Trajectory]
) -> tuple[list[str], Float[np.ndarray, "particle free 3"]]:
    """Names and free control points (unit cube) of the candidates to start from."""
    moments = np.linspace(0.0, problem.duration_s, segments + 1)
    warm = list(warm_start)[: options.candidates]
    patterns = ["warm start"] * len(warm)
    paths = [trajectory.sample(trajectory.start_s + moments).position_m for trajectory in warm]
    if len(warm) < options.candidates:
        found = seed_paths(problem, options.candidates - len(warm), np.random.default_rng(options.seed))
        patterns += [seed.pattern for seed in found]
        paths += [seed.points_m for seed in found]
    controls = np.stack([spline_from_path(path, problem, segments) for path in paths])
    return patterns, np.clip(free_from_control(problem.workspace.unit_from_enu(controls)), 0.0, 1.0)


def _polished(
    scene: Scene,
    seeds: Float[np.ndarray, "particle free 3"],
    options: Options,
    warm: bool,
    progress: Callable[[Progress], None],
    out_of_time: Callable[[], bool],
) -> Iterator[Refinement]:
    """Sets worth judging: after the polish, then after each repair for as long as they are asked for."""
    particles = jnp.asarray(seeds, jnp.float32)
    steps = 0
    if options.candidates > 1 and not warm and not out_of_time():
        progress(Progress("stein", 0.05))
        smooth = jnp.asarray(stein.smoother(particles.shape[1]))
        particles = _explore(scene, particles, smooth, jax.random.key(options.seed), options.kernel)
        steps += STEIN_STEPS
    state = _begin(scene, particles)
    rounds = WARM_POLISH_PENALTIES if warm else POLISH_PENALTIES
    whole = len(rounds) + len(REPAIR_PENALTIES)
    for index, penalty in enumerate((*rounds, *REPAIR_PENALTIES)):
        if out_of_time():
            break
        state, info = _polish(scene, state, jnp.float32(penalty))
        steps += STEPS_PER_ROUND
        lowest = float(np.nanmin(np.asarray(info.ergodic_metric)))
        phase = "polish" if index < len(rounds) else "repair"
        progress(Progress(phase, 0.1 + 0.8 * (index + 1) / whole, lowest))
        if index >= len(rounds) - 1:
            yield Refinement(np.asarray(state.free), steps)
    else:
        return
    yield Refinement(np.asarray(state.free), steps)


@eqx.filter_jit
def _explore(
    scene: Scene, particles: Float[Array, "particle free 3"], smooth: Array, key: Array, kernel: Kernel
) -> Float[Array, "particle free 3"]:
    """The Stein phase: all candidates together, under soft penalties."""
    reference = jax.vmap(lambda free: augmented_lagrangian.init(scene, free).reference)(particles)

    def score(free: Array, reference: Array) -> Array:
        return -jax.grad(lambda free: augmented_lagrangian.penalised(scene, free, reference, STEIN_PENALTY))(free)

    def body(state: stein.State, _: None) -> tuple[stein.State, None]:
        return stein.step(state, jax.vmap(score)(state.particles, reference), kernel, smooth, STEIN_STEPS), None

    state, _ = jax.lax.scan(body, stein.init(stein.separated(particles, key)), None, length=STEIN_STEPS)
    return state.particles


@eqx.filter_jit
def _begin(scene: Scene, particles: Float[Array, "particle free 3"]) -> augmented_lagrangian.State:
    return jax.vmap(lambda free: augmented_lagrangian.init(scene, free))(particles)


@eqx.filter_jit
def _polish(
    scene: Scene, state: augmented_lagrangian.State, penalty: Float[Array, ""]
) -> tuple[augmented_lagrangian.State, augmented_lagrangian.Info]:
    """One round of multipliers for every candidate."""
    return jax.vmap(lambda one: augmented_lagrangian.step(scene, one, penalty, SMOOTHNESS_WEIGHT, STEPS_PER_ROUND))(
        state
    )


def _plan(
    problem: Problem, options: Options, judge: Judge, candidates: list[Candidate], steps: int, stopped: bool
) -> Plan:
    """Select, and measure the set against the baseline."""
    selected = select(candidates)
    if selected is None:
        finite = np.isfinite([candidate.cost for candidate in candidates]).any()
        status = Status.INFEASIBLE if finite else Status.DIVERGED
        length_m = float(np.median([candidate.report.length_m for candidate in candidates]))
    else:
        status = Status.STEP_LIMIT if stopped else Status.CONVERGED
        length_m = candidates[selected].report.length_m
    baseline, _ = lawnmower_ergodic_metric(problem, judge.ergodic_metric, length_m)
    paths = np.stack([at_middles(candidate.trajectory).position_m for candidate in candidates])
    return Plan(
        status=status,
        candidates=tuple(candidates),
        selected=selected,
        lawnmower_ergodic_metric=baseline,
        diversity=diversity(problem.workspace.unit_from_enu(paths)),
        steps=steps,
    )
