"""Stein steps of a set: what the kernel does, what a prior does, and what a score without numbers does not."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from planner import stein, sves
from planner.polish import ANNEALING, explored
from planner.priors import GaussianPrior, Prior, ScalePrior
from planner.problem import Kernel, Limits, Method
from planner.scene import Scene, free_from_control, knots_for, scene_of
from planner.seeds import seed_paths, spline_from_path
from tests.planner.small_problem import BOX, OPTIONS, problem_with


def scene_and_seeds(count: int, **changes: object) -> tuple[Scene, np.ndarray]:
    """What Stein steps are given."""
    segments, per_segment = knots_for(problem_with(), OPTIONS)
    paths = [seed.points_m for seed in seed_paths(problem_with(), count, np.random.default_rng(0))]
    control = [BOX.unit_from_enu(spline_from_path(path, problem_with(), segments)) for path in paths]
    scene = scene_of(problem_with(**changes), OPTIONS, segments, per_segment)
    return scene, np.clip(free_from_control(np.stack(control)), 0.0, 1.0)


def test_the_kernel_decides_how_the_set_moves() -> None:
    scene, seeds = scene_and_seeds(3)

    def moved(kernel: Kernel, begins: np.ndarray = seeds) -> np.ndarray:
        return explored(scene, begins, kernel, 0, [ANNEALING.steps])[0]

    def apart(particles: np.ndarray) -> float:
        return float(np.mean([np.linalg.norm(particles[i] - particles[j]) for i in range(3) for j in range(i)]))

    sets = {kernel: moved(kernel) for kernel in (Kernel.MARKOV, Kernel.SIGNATURE, Kernel.IDENTITY, Kernel.CONSTANT)}
    for one, other in itertools.combinations(sets.values(), 2):
        assert np.abs(one - other).max() > 0.05
    # Alike for all, a step is no search: nothing distinguishes one candidate from another but where it began. (From the
    # middle of the box, as its walls would hold some of them up.)
    amid = 0.5 + 0.1 * (seeds - 0.5)
    np.testing.assert_allclose(np.ptp(moved(Kernel.CONSTANT, amid) - amid, axis=0), 0.0, atol=1e-5)
    # Without repulsion they move each on its own; with it they end farther apart.
    assert np.ptp(sets[Kernel.IDENTITY] - seeds, axis=0).max() > 0.05
    assert apart(sets[Kernel.MARKOV]) > 1.2 * apart(sets[Kernel.IDENTITY])


def test_a_candidate_whose_score_has_no_numbers_does_not_spoil_the_others() -> None:
    _, seeds = scene_and_seeds(4)
    score = np.random.default_rng(0).normal(size=seeds.shape).astype(np.float32)
    broken, silent = score.copy(), score.copy()
    broken[1, 3], silent[1] = np.nan, 0.0
    smooth, annealing = stein.smoother(seeds.shape[1]), stein.Annealing(20, 0.06, 0.001)
    step = jax.jit(lambda state, score: stein.step(state, score, Kernel.MARKOV, smooth, annealing))
    state = without = stein.init(jnp.asarray(seeds, jnp.float32))
    for _ in range(2):
        state, without = step(state, broken), step(without, silent)
    assert np.isfinite(state.particles).all()
    np.testing.assert_array_equal(state.particles, without.particles)


@pytest.mark.parametrize(
    ("method", "firm"),
    [
        (Method.DEFAULT, GaussianPrior(0.5)),
        (Method.DEFAULT, ScalePrior(1.0, 10.0)),
        (Method.SVES, GaussianPrior(1.0)),
        (Method.SVES, ScalePrior(1.0, 200.0)),
    ],
)
def test_a_prior_on_the_knots_holds_paths_to_their_seeds_as_firmly_as_it_says(method: Method, firm: Prior) -> None:
    # The paper's plain steps diverge where limits are narrow.
    scene, seeds = scene_and_seeds(2, limits=Limits(30.0, 30.0, 30.0, 40.0))

    def moved(prior: Prior | None) -> float:
        if method is Method.SVES:
            found, _ = sves.descended(scene, seeds, Kernel.IDENTITY, [sves.STEPS_AT_ONCE], prior)
        else:
            found, _ = explored(scene, seeds, Kernel.IDENTITY, 0, [ANNEALING.steps], prior)
        return float(np.sqrt(np.mean((found - seeds) ** 2)))

    free_m = moved(None)
    assert moved(GaussianPrior(1e3)) == pytest.approx(free_m, rel=0.05)
    assert moved(firm) < 0.9 * free_m
