"""The whole solve on small problems: what comes out is proven, different, repeatable and better than a lawnmower."""

import dataclasses
import itertools
from collections.abc import Callable, Iterable

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from planner import gate, solver, stein, sves
from planner.gate_report import Violation, ViolationKind
from planner.information import gaussians, uniform
from planner.obstacles import Box, Cylinder, ObstacleField, Sphere
from planner.plan import Candidate, Status
from planner.polish import ANNEALING, Round, explored, parted, polished
from planner.priors import GaussianPrior, Prior, ScalePrior, WalkPrior
from planner.problem import Covered, Kernel, Limits, Method, MetricWeights, Options, Problem
from planner.scene import Scene, free_from_control, knots_for, scene_of
from planner.seeds import LAST_RESORT, seed_paths, spline_from_path
from planner.seeds.seed_set import ORDER
from planner.solver import Progress, solve
from planner.spectral_metric import mean_basis
from planner.trajectory import Motion, Trajectory
from planner.workspace import Workspace
from tests.interpolating import interpolating

BOX = Workspace(np.array([0.0, 0.0, 5.0]), np.array([60.0, 40.0, 15.0]))
OPTIONS = Options(candidates=4, modes=(8, 8, 1), kernel=Kernel.RBF)
OBSTACLE_LIST = [
    Sphere(np.array([20.0, 20.0, 10.0]), 4.0),
    Cylinder(np.array([40.0, 12.0]), 3.0, 0.0, 20.0),
    Box(np.array([30.0, 28.0, 0.0]), np.array([36.0, 34.0, 20.0])),
]
OBSTACLES = ObstacleField.of(OBSTACLE_LIST)


def problem_with(**changes: object) -> Problem:
    problem = Problem(
        workspace=BOX,
        information=uniform(BOX, (24, 16, 4)),
        obstacles=OBSTACLES,
        limits=Limits(max_speed_mps=3.0, max_climb_mps=2.0, max_descent_mps=1.0, max_acceleration_mps2=4.0),
        start=Motion.at_rest(np.array([5.0, 5.0, 10.0])),
        end_position_m=np.array([5.0, 5.0, 10.0]),
        duration_s=100.0,
        vehicle_radius_m=0.4,
        clearance_margin_m=0.8,
    )
    return dataclasses.replace(problem, **changes)


@pytest.fixture(scope="module")
def plan():
    return solve(problem_with(), OPTIONS)


def tail(curve: Trajectory, from_s: float) -> Trajectory:
    """What is left of a curve, as a curve of its own."""
    moments = np.linspace(from_s, curve.end_s, curve.segments + 1)
    return interpolating(curve.sample(moments).position_m, moments[1] - moments[0], curve.motion_at(from_s))


def test_what_is_selected_is_proven_and_the_best_of_those_that_are(plan) -> None:
    assert plan.status is Status.CONVERGED
    assert gate.prove(plan.best.trajectory, problem_with()).report.passed
    assert plan.best.cost == min(candidate.cost for candidate in plan.ranked())
    assert plan.best.report.min_clearance_m >= 0.8


def test_it_covers_a_level_area_better_than_a_lawnmower_of_its_length(plan) -> None:
    assert plan.best.ergodic_metric < plan.lawnmower_ergodic_metric


def test_candidates_differ(plan) -> None:
    assert plan.diversity.mean_pair_distance > 0.1
    assert plan.diversity.effective_plans > 2.0


def test_the_same_seed_gives_the_same_plan_and_another_seed_another(plan) -> None:
    again = solve(problem_with(), OPTIONS)
    np.testing.assert_array_equal(plan.best.trajectory.control_points_m, again.best.trajectory.control_points_m)
    other = solve(problem_with(), dataclasses.replace(OPTIONS, seed=5))
    assert not np.array_equal(
        plan.candidates[-1].trajectory.control_points_m, other.candidates[-1].trajectory.control_points_m
    )


def test_peaked_information_is_covered_at_least_twice_as_well_as_by_a_lawnmower() -> None:
    peaked = gaussians(BOX, np.array([[45.0, 30.0, 10.0], [10.0, 30.0, 10.0]]), np.full((2, 3), 4.0), np.ones(2))
    found = solve(problem_with(information=peaked), OPTIONS)
    assert found.best.ergodic_metric < 0.5 * found.lawnmower_ergodic_metric


def test_a_replan_begins_as_the_vehicle_moves_and_remembers_what_was_covered(plan) -> None:
    curve = plan.best.trajectory
    now_s = 20.0
    flown = curve.sample(np.linspace(0.0, now_s, 400)).position_m
    covered = Covered(mean_basis(BOX.unit_from_enu(flown), np.full(400, 1 / 400), OPTIONS.modes), now_s)
    rest = problem_with(start=curve.motion_at(now_s), duration_s=curve.duration_s - now_s, covered=covered)
    replanned = solve(rest, OPTIONS, warm_start=[tail(plan.best.trajectory, now_s)])
    assert replanned.selected is not None
    start = replanned.best.trajectory.motion_at(0.0)
    np.testing.assert_allclose(start.position_m, rest.start.position_m, atol=1e-9)
    np.testing.assert_allclose(start.velocity_mps, rest.start.velocity_mps, atol=1e-9)
    np.testing.assert_allclose(start.acceleration_mps2, rest.start.acceleration_mps2, atol=1e-8)
    # Flown and still to fly together are about as good as the plan was, so memory was kept.
    assert replanned.best.ergodic_metric < 1.5 * plan.best.ergodic_metric


def test_different_are_those_that_may_be_flown(monkeypatch: pytest.MonkeyPatch) -> None:
    measured, offered = [], itertools.count()
    own, judged = solver.diversity, solver.Judge.candidate

    def refusing_every_second(self, trajectory: Trajectory, pattern: str) -> Candidate:
        candidate = judged(self, trajectory, pattern)
        if next(offered) % 2 == 0:
            return candidate
        violation = Violation(ViolationKind.BOX, 1.0, 0.0, 0.0, np.zeros(3), "refused")
        refusal = dataclasses.replace(candidate.report, violations=(violation,))
        return dataclasses.replace(candidate, trajectory=trajectory, refusal=refusal)

    monkeypatch.setattr(solver.Judge, "candidate", refusing_every_second)
    monkeypatch.setattr(solver, "diversity", lambda paths: measured.append(len(paths)) or own(paths))
    plan = solve(problem_with(obstacles=ObstacleField.of([])), OPTIONS, time_left_s=lambda: 0.0)
    passed = sum(candidate.feasible for candidate in plan.candidates)
    assert 0 < passed <= 2
    assert measured == [passed]


def test_seeds_and_ways_around_obstacles_keep_to_their_share_of_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    left, asked = [40.0], []
    drawn = solver.seed_paths

    def slow(problem: Problem, count: int, rng: np.random.Generator, go_on) -> list:
        asked.append(go_on())
        left[0] -= 15.0
        asked.append(go_on())
        return drawn(problem, count, rng, go_on)

    def led(curve: Trajectory, *_) -> np.ndarray:
        left[0] -= 100.0
        asked.append("a way around")
        return curve.sample(np.linspace(curve.start_s, curve.end_s, 100)).position_m

    monkeypatch.setattr(solver, "seed_paths", slow)
    monkeypatch.setattr(solver, "rerouted", led)
    monkeypatch.setattr(solver.TimeBudget, "rounds", lambda *_: iter(()))
    problem = problem_with(end_position_m=None, clearance_margin_m=5.0)
    plan = solve(problem, dataclasses.replace(OPTIONS, candidates=5), time_left_s=lambda: left[0])
    assert asked == [True, False, "a way around"]
    # The last are variations of the first.
    patterns = [candidate.seed_pattern for candidate in plan.candidates]
    assert patterns[3:] == patterns[:2]
    assert plan.status is not Status.CONVERGED


def test_a_problem_without_a_way_is_said_to_be_infeasible() -> None:
    walled = ObstacleField.of([Box(np.array([25.0, -1.0, 0.0]), np.array([35.0, 41.0, 20.0]))])
    found = solve(problem_with(obstacles=walled, end_position_m=np.array([55.0, 20.0, 10.0])), OPTIONS)
    assert found.status is Status.INFEASIBLE
    assert found.selected is None
    assert all(candidate.report.violations for candidate in found.candidates)
    with pytest.raises(ValueError, match="nothing to fly"):
        _ = found.best


def test_out_of_time_at_once_still_returns_judged_candidates() -> None:
    found = solve(problem_with(), OPTIONS, time_left_s=lambda: 0.0)
    assert len(found.candidates) == OPTIONS.candidates
    assert found.status in (Status.STEP_LIMIT, Status.INFEASIBLE)


def test_with_less_time_than_it_takes_a_set_still_passes_and_is_better_than_its_seeds() -> None:
    class Clock:
        """Every look at it costs as much as a few steps do."""

        left_s = 1.0

        def __call__(self) -> float:
            self.left_s -= 0.02
            return self.left_s

    seeds = solve(problem_with(), OPTIONS, time_left_s=lambda: 0.0)
    full = solve(problem_with(), OPTIONS)
    found = solve(problem_with(), OPTIONS, time_left_s=Clock())
    assert found.status is Status.STEP_LIMIT
    assert 0 < found.steps < full.steps
    assert full.best.cost < found.best.cost < seeds.best.cost


def test_progress_goes_from_nothing_to_the_gate_without_falling_back() -> None:
    told: list[Progress] = []
    solve(problem_with(), OPTIONS, progress=told.append)
    shares = [one.done for one in told]
    assert shares == sorted(shares)
    assert told[0].phase == "seeds"
    assert told[-1].phase == "gate"


def test_no_candidate_ends_worse_than_the_seed_it_grew_from() -> None:
    options = dataclasses.replace(OPTIONS, candidates=3)
    seeds = solve(problem_with(), options, time_left_s=lambda: 0.0)
    full = solve(problem_with(), options)
    for seed, candidate in zip(seeds.candidates, full.candidates, strict=True):
        assert seed.seed_pattern == candidate.seed_pattern
        if seed.feasible:
            assert candidate.feasible
            assert candidate.cost <= seed.cost


def test_warm_candidates_that_coincide_are_parted_and_no_others(plan) -> None:
    rest = plan.best.trajectory.from_knot(10)
    left = problem_with(start=rest.motion_at(rest.start_s), duration_s=rest.duration_s)
    options = dataclasses.replace(OPTIONS, candidates=2, time_step_s=rest.duration_s / (2 * rest.segments))
    first, second = solve(left, options, warm_start=[rest, rest]).candidates
    assert first.feasible
    assert second.feasible
    apart_m = np.abs(first.trajectory.control_points_m - second.trajectory.control_points_m).max()
    assert apart_m > 1.0
    # What does not coincide with an earlier one is not touched.
    free = np.stack([rest.control_points_m, rest.control_points_m, rest.control_points_m[::-1]]) / 100.0
    moved = np.abs(parted(free, 0) - free).max(axis=(1, 2))
    np.testing.assert_allclose(moved[[0, 2]], 0.0, atol=1e-6)
    assert moved[1] > 1e-3


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


def test_a_prior_on_the_knots_is_an_option_of_a_solve() -> None:
    options = dataclasses.replace(OPTIONS, candidates=2, knot_prior=WalkPrior(0.1, 0.02))
    assert solve(problem_with(), options).selected is not None


@pytest.mark.parametrize("kernel", [Kernel.MARKOV, Kernel.IDENTITY, Kernel.CONSTANT, Kernel.SIGNATURE])
def test_every_kernel_plans(kernel: Kernel) -> None:
    found = solve(problem_with(), dataclasses.replace(OPTIONS, kernel=kernel, candidates=3))
    assert found.selected is not None


def test_the_papers_recipe_runs_and_its_candidates_are_judged_like_all_others() -> None:
    options = dataclasses.replace(OPTIONS, method=Method.SVES, metric_weights=MetricWeights.SQUARED)
    found = solve(problem_with(), options)
    assert found.steps >= 500
    assert len(found.candidates) == OPTIONS.candidates
    if found.selected is not None:
        assert gate.prove(found.best.trajectory, problem_with()).report.passed


def test_where_no_pattern_comes_to_anything_a_direct_way_is_planned(monkeypatch: pytest.MonkeyPatch) -> None:
    def too_fast(problem, count, rng, go_on=lambda: True, order=ORDER):
        drawn = seed_paths(problem, count, rng, go_on, order)
        if order is LAST_RESORT:
            return drawn
        # The same places in any order: no step of the polish is taken that could mend them.
        return [dataclasses.replace(seed, points_m=rng.permutation(seed.points_m)) for seed in drawn]

    monkeypatch.setattr(solver, "seed_paths", too_fast)
    monkeypatch.setattr(solver, "explored", lambda _scene, particles, *_: (particles, 0))
    monkeypatch.setattr(solver, "polished", lambda _scene, particles, *_: (particles, 0))
    for end_m in (None, np.array([52.0, 33.0, 11.0]), problem_with().end_position_m):
        problem = problem_with(end_position_m=end_m)
        found = solve(problem, OPTIONS)
        assert found.best.seed_pattern == "direct way"
        assert gate.prove(found.best.trajectory, problem).report.passed
    monkeypatch.setattr(solver, "LAST_RESORT", ORDER)
    assert solve(problem_with(), OPTIONS).status is Status.INFEASIBLE


def test_what_ways_around_do_not_mend_begins_at_its_seed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    sets, penalties = [], []

    def begun(scene: Scene, particles: np.ndarray, rounds: Iterable[Round], after_round: Callable[[float], None]):
        done = list(rounds)
        sets.append(np.array(particles))
        penalties.append([one.penalty for one in done])
        return polished(scene, particles, done, after_round)

    # So soft a polish leaves all of them to repairs, of which the first is the last.
    monkeypatch.setattr(solver, "POLISH", (Round(1e-3, 90),))
    monkeypatch.setattr(solver, "MOST_REPAIRS", 1)
    monkeypatch.setattr(solver, "polished", begun)
    monkeypatch.setattr(solver, "explored", lambda _scene, particles, *_: (particles, 0))
    found = solve(problem_with(obstacles=ObstacleField.of(())), OPTIONS).candidates
    seeds, *repaired = sets
    assert repaired
    # Ways around, of nothing here, move them by less than a thousandth of the box.
    assert all(np.abs(seeds - one).max(axis=(1, 2)).min() < 1e-3 for part in repaired for one in part)
    assert penalties[1:] == [[one.penalty for one in solver.LAST_REPAIR]] * len(repaired)
    assert all(candidate.feasible for candidate in found)


def test_where_the_papers_steps_diverge_the_seeds_are_left_and_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    paper = dataclasses.replace(OPTIONS, method=Method.SVES)
    found = solve(problem_with(), paper)
    assert found.status is Status.DIVERGED
    # It is the narrow limits that are too stiff for plain steps.
    assert solve(problem_with(limits=Limits(30.0, 30.0, 30.0, 40.0)), paper).status is not Status.DIVERGED
    monkeypatch.setattr(sves, "STEPS", 0)
    seeds = solve(problem_with(), paper)
    assert [one.cost for one in found.candidates] == pytest.approx([one.cost for one in seeds.candidates])


def test_a_mission_of_similar_size_runs_what_is_compiled(plan) -> None:
    similar = problem_with(
        information=gaussians(
            BOX, np.array([[45.0, 30.0, 10.0]]), np.array([[8.0, 8.0, 3.0]]), np.ones(1), (30, 20, 4)
        ),
        obstacles=ObstacleField.of([Sphere(np.array([25.0, 12.0, 10.0]), 3.0), *OBSTACLE_LIST[1:]]),
        duration_s=98.0,
    )
    compiled_s: list[float] = []

    def listen(event: str, duration_secs: float, **_: str | int) -> None:
        if event == "/jax/core/compile/backend_compile_duration":
            compiled_s.append(duration_secs)

    jax.monitoring.register_event_duration_secs_listener(listen)
    try:
        found = solve(similar, OPTIONS)
    finally:
        jax.monitoring.unregister_event_duration_listener(listen)
    assert found.selected is not None
    assert compiled_s == []


def test_plans_keep_to_a_jerk_and_a_length() -> None:
    limits = dataclasses.replace(problem_with().limits, max_jerk_mps3=3.0)
    found = solve(problem_with(limits=limits, max_length_m=220.0), OPTIONS)
    curve = found.best.trajectory
    moments = np.linspace(curve.start_s, curve.end_s, 5001)
    samples = curve.sample(moments)
    jerk = np.linalg.norm(np.diff(samples.acceleration_mps2, axis=0), axis=1) / np.diff(moments)
    assert jerk.max() <= 3.0 * (1.0 + 1e-6)
    assert np.linalg.norm(np.diff(samples.position_m, axis=0), axis=1).sum() <= 220.0
    # Both are used, not merely kept.
    assert jerk.max() > 1.5
    assert found.best.report.length_m > 200.0
