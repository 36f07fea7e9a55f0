"""A solve that is short of time, refused by the gate, walled in or diverging: what it does, and what it says."""

import dataclasses
import itertools
from collections.abc import Callable, Iterable

import numpy as np
import pytest

from planner import gate, solver, sves
from planner.gate_report import Violation, ViolationKind
from planner.obstacles import Box, ObstacleField
from planner.plan import Candidate, Status
from planner.polish import Round, polished
from planner.problem import Limits, Method, Problem
from planner.scene import Scene
from planner.seeds import LAST_RESORT, seed_paths
from planner.seeds.seed_set import ORDER
from planner.solver import solve
from planner.trajectory import Trajectory
from tests.planner.small_problem import OPTIONS, problem_with


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
