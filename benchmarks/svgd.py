"""Stein variational gradient descent: our step against another library's, and the product against plain SVGD.

python -m benchmarks.svgd

Steps are compared at the same particles with the same gradient, the separable one. The time to reach plain SVGD's
final metric starts with both from the same set, and counts what the product spends on seeds, where it uses them; which
of its steps gets there is found beforehand, so that no looks at the metric are timed. It comes first: its calls take
milliseconds, and would pay for the memory that the larger sets of the other table leave.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable

import blackjax
import jax
import jax.numpy as jnp
import numpy as np
import optax

from benchmarks.plain_svgd import PARTICLES, SAMPLES, SVGD_STEPS, plain_svgd, random_set
from benchmarks.quality import CUBE, FLAT, problem_of
from benchmarks.timing import interleaved_ms, machine
from planner import stein, sves
from planner.information import uniform
from planner.polish import ANNEALING, Particles, Round, explored, polished
from planner.problem import Kernel, MetricWeights, Options, Problem
from planner.scene import Scene, free_from_control, knots_for, scene_of
from planner.seeds import seed_paths, spline_from_path
from planner.solver import POLISH
from planner.spectral_metric import SpectralMetric

# Particles, samples, modes.
SIZES = ((50, 100, (8, 8, 1)), (4, 50, (8, 8, 8)), (64, 100, (8, 8, 8)))
STEPS_A_CALL = 20
STEP_SIZE = 0.5
REPEATS = 25

RACES = 5
TURNS = 11
IN_A_ROW = 3


def step_against_blackjax() -> None:
    """Milliseconds a step of the whole set, and how far one step of each leads apart."""
    print("\n| candidates | samples | modes | ours | blackjax.svgd | ratio | largest difference |")
    print("|---|---|---|---|---|---|---|")
    for particles, samples, modes in SIZES:
        metric = SpectralMetric.of(uniform(CUBE).coefficients(modes), MetricWeights.LINEAR)
        axes = 3 if modes[2] > 1 else 2
        weight = jnp.full(samples, 1.0 / samples)
        middle = jnp.full((samples, 3 - axes), 0.5)

        def score(points: jax.Array, metric=metric, weight=weight, middle=middle) -> jax.Array:
            def likelihood(points: jax.Array) -> jax.Array:
                return -sves.INVERSE_TEMPERATURE * metric(jnp.concatenate([points, middle], axis=1), weight)

            return jax.grad(likelihood)(points)

        start = jax.random.uniform(jax.random.key(0), (particles, samples, axes))

        def ours(points: jax.Array, steps: int = STEPS_A_CALL, score=score) -> jax.Array:
            def body(points: jax.Array, _: None) -> tuple[jax.Array, None]:
                return stein.sves_step(points, jax.vmap(score)(points), Kernel.RBF, STEP_SIZE), None

            return jax.lax.scan(body, points, None, length=steps)[0]

        library = blackjax.svgd(score, optax.sgd(STEP_SIZE))

        def theirs(points: jax.Array, steps: int = STEPS_A_CALL, library=library) -> jax.Array:
            # Its bandwidth of the first step would else be one.
            first = blackjax.vi.svgd.update_median_heuristic(library.init(points, {"length_scale": jnp.float32(1.0)}))
            return jax.lax.scan(lambda state, _: (library.step(state), None), first, None, length=steps)[0].particles

        fast, other = jax.jit(ours, static_argnums=1), jax.jit(theirs, static_argnums=1)
        moved = (fast(start, 1) - start, other(start, 1) - start)
        apart = float(jnp.abs(moved[0] - moved[1]).max() / jnp.abs(moved[1]).max())
        found = interleaved_ms(
            {"ours": lambda f=fast, x=start: f(x), "theirs": lambda f=other, x=start: f(x)}, repeats=REPEATS
        )
        mine, its = (found[name] / STEPS_A_CALL for name in ("ours", "theirs"))
        print(
            f"| {particles} | {samples} | {'×'.join(str(k) for k in modes if k > 1)} | {mine:.3f} ms | {its:.3f} ms "
            f"| {its / mine:.2f} | {apart:.0e} |",
            flush=True,
        )


@dataclasses.dataclass(frozen=True)
class Race:
    """One problem in which both start.

    Attributes:
        problem: What is explored.
        options: Of the product.
        scene: The same as arrays.
        segments: Of a path.
    """

    problem: Problem
    options: Options
    scene: Scene
    segments: int

    @classmethod
    def of(cls, deep: bool, length: float, seed: int) -> Race:
        """Level ground in two or three dimensions, a hundred samples, paths at most so long."""
        box, modes = (CUBE, (8, 8, 8)) if deep else (FLAT, (8, 8, 1))
        problem = problem_of(box, uniform(box, (32, 32, 8)), length, np.full(3, 0.1) * box.lengths_m)
        options = Options(candidates=PARTICLES, modes=modes, time_step_s=problem.duration_s / SAMPLES, seed=seed)
        segments, per_segment = knots_for(problem, options)
        return cls(problem, options, scene_of(problem, options, segments, per_segment), segments)

    def set_along(self, paths_unit: np.ndarray) -> Particles:
        """Free control points of given paths."""
        return self._free(self.problem.workspace.enu_from_unit(paths_unit))

    def seeded_set(self) -> Particles:
        """The product's seeds."""
        found = seed_paths(self.problem, PARTICLES, np.random.default_rng(self.options.seed))
        return self._free(np.stack([seed.points_m for seed in found]))

    def _free(self, paths_m: np.ndarray) -> Particles:
        splines = np.stack([spline_from_path(path, self.problem, self.segments) for path in paths_m])
        return np.clip(free_from_control(self.problem.workspace.unit_from_enu(splines)), 0.0, 1.0)


def rounds_to(race: Race, particles: Particles, target: float) -> list[Round] | None:
    """The product's own rounds up to the step at which the best of the set is at a metric; None: it never is."""
    if float(np.min(metrics_of(race.scene, particles))) <= target:
        return []
    for number, one in enumerate(POLISH):
        for steps in range(1, one.steps + 1):
            rounds, lowest = [*POLISH[:number], Round(one.penalty, steps)], []
            polished(race.scene, particles, rounds, lowest.append)
            if lowest[-1] <= target:
                return rounds
    return None


def way_to(race: Race, draw: Callable[[], Particles], target: float, stein_steps: int) -> Callable[[], object] | None:
    """What the product does until the best of the set is at a metric; None: it never is.

    Args:
        race: The problem.
        draw: Gives the set to start from, which is a part of it.
        target: E.
        stein_steps: How many are taken before the rounds.
    """

    def begun() -> Particles:
        particles = draw()
        if not stein_steps:
            return particles
        return explored(race.scene, particles, race.options.kernel, race.options.seed, [stein_steps])[0]

    rounds = rounds_to(race, begun(), target)
    return None if rounds is None else lambda: polished(race.scene, begun(), rounds, lambda _: None)


@jax.jit
def metrics_of(scene: Scene, particles: Particles) -> jax.Array:
    """E of every candidate."""
    return jax.vmap(lambda free: scene.ergodic_metric(scene.positions(scene.control_points(free))))(particles)


def time_to_plain_svgd() -> None:
    """Seconds of plain RBF-SVGD's 500 steps, and of the product until it is where those ended."""
    print(
        f"\nplain RBF-SVGD: {PARTICLES} candidates, {SVGD_STEPS} steps; medians of {RACES} start sets; in brackets the "
        "share of plain SVGD's time with our gradient, and with autodiff's\n"
    )
    print(
        "| problem | length | E after plain SVGD | its time | its time, autodiff | product, same set "
        "| without Stein steps | product, its seeds |\n|---|---|---|---|---|---|---|---|"
    )
    for name, deep in (("square", False), ("cube", True)):
        modes, axes = ((8, 8, 8), 3) if deep else ((8, 8, 1), 2)
        metric = SpectralMetric.of(uniform(CUBE, (32, 32, 32)).coefficients(modes), MetricWeights.LINEAR)
        rows = []
        for seed in range(RACES):
            start = random_set(metric, axes, seed)
            plain = np.asarray(plain_svgd(metric, start, axes))
            figures = [float(metric(jnp.clip(path, 0.0, 1.0), jnp.full(SAMPLES, 1.0 / SAMPLES))) for path in plain]
            best = int(np.argmin(figures))
            length = float(np.linalg.norm(np.diff(plain[best, :, :axes], axis=0), axis=1).sum())
            race, target = Race.of(deep, length, seed), figures[best]
            same = race.set_along(np.clip(start, 0.0, 1.0))
            ways = {
                "plain": functools.partial(plain_svgd, metric, start, axes),
                "same": way_to(race, lambda same=same: same, target, ANNEALING.steps),
                "alone": way_to(race, lambda same=same: same, target, 0),
                "seeds": way_to(race, race.seeded_set, target, ANNEALING.steps),
            }
            found = interleaved_ms({one: way for one, way in ways.items() if way}, TURNS, in_a_row=IN_A_ROW)
            rows.append((target, length, *(found.get(one, float("nan")) for one in ways)))
        target, length, plain_ms, *product_ms = np.median(rows, axis=0)
        # Last, and once, as it leaves a lot of memory to whatever is timed next.
        autodiff = functools.partial(plain_svgd, metric, random_set(metric, axes, 0), axes, autodiff=True)
        autodiff_ms = interleaved_ms({"autodiff": autodiff}, 1)["autodiff"]
        cells = " | ".join(
            f"{spent_ms:.1f} ms ({spent_ms / plain_ms:.3f}, {spent_ms / autodiff_ms:.4f})" for spent_ms in product_ms
        )
        print(
            f"| {name} | {length:.1f} | {target:.4f} | {plain_ms:.1f} ms | {autodiff_ms:.0f} ms | {cells} |", flush=True
        )


def main() -> None:
    """Print the tables."""
    print(machine())
    print(f"\nthe product's Stein phase is {ANNEALING.steps} steps")
    time_to_plain_svgd()
    step_against_blackjax()


if __name__ == "__main__":
    main()
