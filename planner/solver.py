"""From a problem to a set of proven, different paths (SVES Alg. 1, then a polish of each candidate).

seeds → Stein steps, together → rounds of multipliers, each on its own → ways around for those that the gate refuses →
gate → selection. The caller owns the clock: `time_left_s` is asked between the compiled pieces, which are fitted to
what it says.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from jaxtyping import Float

from planner import sves
from planner.detection_metric import DetectionMetric
from planner.diversity import diversity
from planner.free_space import FreeSpace
from planner.judging import Judge, at_middles, better
from planner.lawnmower import Lawnmowers
from planner.plan import Candidate, Plan, Status
from planner.polish import ANNEALING, Particles, Round, explored, parted, polished
from planner.problem import Method, Options, Problem
from planner.rerouting import rerouted
from planner.scene import TURN_RAD, Scene, free_from_control, knots_for, scene_of, trajectory_of, wanted_interval_s
from planner.seeds import LAST_RESORT, heading_spline, seed_headings, seed_paths, spline_from_path
from planner.selection import select
from planner.time_budget import TimeBudget
from planner.trajectory import Trajectory

# Geometric from nearly free to firm: starting firm freezes a path in the shape of its seed. The shape is found while
# the limits give way; later rounds only make them firm.
POLISH = tuple(Round(float(penalty), 90 if penalty < 0.1 else 30) for penalty in np.geomspace(1e-3, 10.0, 12))
# What a path needs at the least to keep its limits: better than its seed, and not as good as it could be.
HURRIED_POLISH = tuple(Round(penalty, 120) for penalty in (0.01, 0.3, 10.0))
# A replan starts from an answer: its multipliers need no slow start.
WARM_POLISH = (Round(1.0, 60), Round(10.0, 60))
# Of a search: the shape by the ergodic metric of its effort, which is where the polish is loose; then what finds most.
SHAPE_POLISH = POLISH[:6]
SEARCH_POLISH = tuple(Round(float(penalty), 60) for penalty in np.geomspace(1e-2, 10.0, 6))
REPAIR = (Round(1.0, 60), Round(10.0, 60), Round(100.0, 60))
LAST_REPAIR = (*HURRIED_POLISH, *REPAIR[1:])
"""Of those that begin at their seeds again, whose shape is yet to be found."""
# Shares of the time left, where it is short: what drawing seeds may take of it, and ways around obstacles, and what
# Stein steps may, and then the polish, before repairs.
SEED_SHARE = 0.25
DETOUR_SHARE = 0.5
STEIN_SHARE = 0.25
SHAPE_SHARE = 0.3
POLISH_SHARE = 0.8
MOST_REPAIRS = 3
REPAIR_PORTIONS = 4
"""Few candidates need repair: one of so many parts of the set is compiled for it. For a replan, which must not compile
anything in flight, it is the whole set."""
MOST_SETS = 2
"""Where not one candidate passes, so many sets of seeds are tried, as other patterns find other ways; and then direct
ways, which are likeliest to be feasible."""


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
    time_left_s: Callable[[], float] = lambda: math.inf,
) -> Plan:
    """Find a set of different paths, prove them, and select one.

    Args:
        problem: What to explore.
        options: How to solve it.
        warm_start: Earlier candidates, each beginning at its own start time; they take the first places of the set,
            and seeds fill the rest.
        progress: Told now and then how far the solve is.
        time_left_s: Asked between compiled pieces, which are made shorter where it is little; once it is not positive,
            what there is goes to the gate.

    Returns:
        The plan; its status says whether there is something to fly.
    """
    progress(Progress("seeds", 0.0))
    segments, per_segment = knots_for(problem, options)
    budget = TimeBudget(time_left_s)
    work = _Work(problem, options, scene_of(problem, options, segments, per_segment), segments, progress, budget)
    seeds = work.starting_set(warm_start)
    before_s = time_left_s()
    work.offer(seeds)
    # As long again for what comes out in the end.
    budget.reserved_s = before_s - time_left_s() if math.isfinite(before_s) else 0.0
    match options.method:
        case Method.DEFAULT:
            work.refine(seeds)
        case Method.SVES:
            portions = budget.portions(sves.STEPS, sves.STEPS_AT_ONCE, 1.0)
            particles, work.steps = sves.descended(work.scene, seeds, options.kernel, portions, options.knot_prior)
            work.offer(particles)
    progress(Progress("gate", 0.95))
    return work.plan()


@dataclasses.dataclass(frozen=True)
class Stage:
    """A part of the polish.

    Attributes:
        scene: What the candidates are measured against.
        rounds: How firmly and how long, in order.
        hurried: What is done instead where time is short; nothing: the same, shorter.
        share: Of the time left, what it may take.
    """

    scene: Scene
    rounds: tuple[Round, ...]
    hurried: tuple[Round, ...]
    share: float


class _Work:
    """One solve under way: the best version so far of every candidate.

    A candidate's better version stays, so none ends worse than the seed it grew from.
    """

    def __init__(
        self,
        problem: Problem,
        options: Options,
        scene: Scene,
        segments: int,
        progress: Callable[[Progress], None],
        budget: TimeBudget,
    ) -> None:
        self.problem, self.options, self.scene, self.segments = problem, options, scene, segments
        self.progress, self.budget = progress, budget
        self.judge = Judge(problem, options)
        self.patterns: list[str] = []
        self.best: list[Candidate] = []
        # Whose newest version would be the better one if the gate let it through.
        self.refused: list[bool] = []
        self.warm = False
        # Whether steps left no candidate with numbers in it.
        self.diverged = False
        # Sets of seeds that came to nothing.
        self.spent = 0
        self.steps = 0

    def starting_set(self, warm_start: Sequence[Trajectory]) -> Particles:
        """Free control points (unit cube) of the candidates to start from; remembers what each grew from."""
        moments = np.linspace(0.0, self.problem.duration_s, self.segments + 1)
        warm = list(warm_start)[: self.options.candidates]
        self.warm = bool(warm)
        self.patterns = ["warm start"] * len(warm)
        paths = [curve.sample(curve.start_s + moments).position_m for curve in warm]
        flown = [curve.headings_at(curve.start_s + moments) for curve in warm]
        missing = self.options.candidates - len(warm)
        if missing:
            chance = np.random.default_rng(self.options.seed)
            within = self.budget.within(SEED_SHARE)
            if self.spent < MOST_SETS:
                found = seed_paths(self.problem, (1 + self.spent) * missing, chance, within)[-missing:]
            else:
                found = seed_paths(self.problem, missing, chance, within, LAST_RESORT)
            self.patterns += [seed.pattern for seed in found]
            paths += [seed.points_m for seed in found]
        if self.options.modes[2] == 1:
            # Nothing is to be gained by altitude: paths climb only where something is in the way.
            paths = [self._levelled(path) for path in paths]
        if self.problem.obstacles.surfaces:
            paths = [self._over_ground(path) for path in paths]
        if not self.options.explores_headings:
            return np.stack([self._free_along(path) for path in paths])
        turned = [
            new if old is None else self._from_the_start(old)
            for new, old in itertools.zip_longest(seed_headings(paths, self.problem), flown)
        ]
        return np.stack([self._free_along(path, heading) for path, heading in zip(paths, turned, strict=True)])

    def offer(self, particles: Particles, places: Sequence[int] | None = None) -> None:
        """Show candidates to the gate, and keep of each the better version.

        Args:
            particles: Their free control points.
            places: Which of the set they are; None: all of it.
        """
        finite = np.isfinite(particles).all(axis=(1, 2))
        self.diverged |= not finite.any()
        for index, points in zip(range(len(particles)) if places is None else places, particles, strict=True):
            if not np.isfinite(points).all():
                continue
            new = self.judge.candidate(trajectory_of(self.problem, points), self.patterns[index])
            if index == len(self.best):
                self.best.append(new)
                self.refused.append(False)
            kept = self.best[index]
            self.refused[index] = not new.feasible and (not kept.feasible or new.cost < kept.cost)
            self.best[index] = better(kept, new)

    def refine(self, seeds: Particles) -> None:
        """The product's own optimiser, from other seeds where these come to nothing."""
        self._refine(seeds)
        while self.spent < MOST_SETS:
            if self.warm or any(one.feasible for one in self.best) or self.budget.is_over():
                break
            self.spent += 1
            others = self.starting_set(())
            self.offer(others)
            self._refine(others)

    def _refine(self, seeds: Particles) -> None:
        particles = parted(seeds, self.options.seed) if self.warm else seeds
        if self.options.candidates > 1 and not self.warm and not self.budget.is_over():
            self.progress(Progress("stein", 0.05))
            portions = self.budget.portions(ANNEALING.steps, ANNEALING.steps, STEIN_SHARE)
            kernel, seed, prior = self.options.kernel, self.options.seed, self.options.knot_prior
            particles, taken = explored(self.scene, particles, kernel, seed, portions, prior)
            self.steps += taken
        stages = self._stages()
        for number, stage in enumerate(stages):
            due = self.budget.rounds(stage.rounds, stage.share, stage.hurried)
            span = 0.1 + 0.7 * number / len(stages), 0.1 + 0.7 * (number + 1) / len(stages)
            particles = self._descended(stage.scene, particles, due, len(stage.rounds), "polish", *span)
            self.offer(particles)
        self._last, self._last_scene = np.array(particles), stages[-1].scene
        for repair in range(MOST_REPAIRS):
            if not any(self.refused) or self.budget.is_over():
                break
            rounds = REPAIR
            if repair == MOST_REPAIRS - 1:
                # Whatever ways around have not mended is stuck where it is.
                self._last[self.refused] = seeds[self.refused]
                rounds = LAST_REPAIR
            at = 0.8 + 0.15 * repair / MOST_REPAIRS
            self._repair(rounds, at, at + 0.15 / MOST_REPAIRS)

    def _stages(self) -> list[Stage]:
        """What the polish goes by: the metric, and of a search then what it finds."""
        if self.problem.search is None or self.options.explores_headings:
            # What is seen of the ground says nothing about headings.
            rounds, hurried = (WARM_POLISH, ()) if self.warm else (POLISH, HURRIED_POLISH)
            return [Stage(self.scene, rounds, hurried, POLISH_SHARE)]
        # While a flight goes on what is left of it gets shorter, and nothing may be compiled for that.
        interval_s = max(wanted_interval_s(self.problem, self.options), self.problem.duration_s / self.segments)
        spacing_m = self.problem.limits.max_speed_mps * interval_s / self.scene.samples_per_segment
        finding = DetectionMetric.of(self.problem.search, self.problem.reach_m, spacing_m)
        searching = dataclasses.replace(self.scene, metric=finding)
        if self.warm:
            return [Stage(searching, WARM_POLISH, (), POLISH_SHARE)]
        return [
            Stage(self.scene, SHAPE_POLISH, HURRIED_POLISH, SHAPE_SHARE),
            Stage(searching, SEARCH_POLISH, WARM_POLISH, POLISH_SHARE),
        ]

    def _repair(self, rounds: Sequence[Round], done_from: float, done_to: float) -> None:
        """Lead those that the gate refuses around what they run through, and polish them, a few at a time."""
        # From where the optimiser left off, which is nearer to good than the seed that may have been kept.
        detours = self._around_obstacles(self._last)
        refused = np.flatnonzero(self.refused)
        width = len(detours) if self.warm else -(-len(detours) // REPAIR_PORTIONS)
        for first in range(0, len(refused), width):
            if first and self.budget.is_over():
                break
            portion = refused[first : first + width]
            share = (done_to - done_from) / len(refused)
            # One width is one compiled shape, so what is missing is filled up.
            found = self._descended(
                self._last_scene,
                detours[np.resize(portion, width)],
                self.budget.rounds(rounds, 1.0),
                len(rounds),
                "repair",
                done_from + share * first,
                done_from + share * (first + len(portion)),
            )[: len(portion)]
            self._last[portion] = found
            self.offer(found, portion.tolist())

    def plan(self) -> Plan:
        """Select, and measure the set against the baseline."""
        selected = select(self.best)
        if selected is None:
            status, length_m = Status.INFEASIBLE, float(np.median([one.report.length_m for one in self.best]))
        else:
            status = self._ended()
            length_m = self.best[selected].report.length_m
        baseline, found_by_baseline = float("nan"), None
        if not self.warm:
            lawnmowers = Lawnmowers(self.problem, length_m)
            baseline, _ = lawnmowers.best(self.judge.ergodic_metric)
            if self.problem.search is not None:
                missed, _ = lawnmowers.best(self.judge.objective)
                found_by_baseline = 1.0 - missed
        flyable = [candidate for candidate in self.best if candidate.feasible] or self.best
        paths = np.stack([at_middles(candidate.trajectory).position_m for candidate in flyable])
        return Plan(
            status=status,
            candidates=tuple(self.best),
            selected=selected,
            lawnmower_ergodic_metric=baseline,
            lawnmower_probability_found=found_by_baseline,
            diversity=diversity(self.problem.workspace.unit_from_enu(paths)),
            steps=self.steps,
        )

    def _ended(self) -> Status:
        """How the steps ended, where something is left to fly."""
        if self.diverged:
            return Status.DIVERGED
        return Status.STEP_LIMIT if self.budget.fell_short else Status.CONVERGED

    def _descended(
        self,
        scene: Scene,
        particles: Particles,
        rounds: Iterable[Round],
        most_rounds: int,
        phase: str,
        done_from: float,
        done_to: float,
    ) -> Particles:
        done = 0

        def after_round(lowest: float) -> None:
            nonlocal done
            done += 1
            # What a search leaves undone is not on the metric's scale.
            shown = lowest if scene is self.scene else None
            self.progress(Progress(phase, done_from + (done_to - done_from) * done / most_rounds, shown))

        found, steps = polished(scene, particles, rounds, after_round)
        self.steps += steps
        return found

    def _around_obstacles(self, particles: Particles) -> Particles:
        """The set with its refused candidates led around what they run through."""
        free, within = FreeSpace(self.problem), self.budget.within(DETOUR_SHARE)
        found = np.array(particles)
        for index, refused in enumerate(self.refused):
            if refused and np.isfinite(particles[index]).all() and within():
                # The way changes, the headings on it (where there are any) stay.
                found[index, :, :3] = self._free_along(rerouted(trajectory_of(self.problem, particles[index]), free))
        return found

    def _from_the_start(self, heading_rad: Float[np.ndarray, "moment"]) -> Float[np.ndarray, "moment"]:
        """The same heading, counted in whole turns from the one that the vehicle begins with."""
        if self.problem.start_turning is None:
            return heading_rad
        turns = np.round((self.problem.start_turning.yaw_rad - heading_rad[0]) / TURN_RAD)
        return heading_rad + TURN_RAD * turns

    def _levelled(self, path_m: Float[np.ndarray, "moment 3"]) -> Float[np.ndarray, "moment 3"]:
        start, end = self.problem.start.position_m, self.problem.end_position_m
        up = np.linspace(start[2], start[2] if end is None else end[2], len(path_m))
        return np.column_stack([path_m[:, :2], up])

    def _over_ground(self, path_m: Float[np.ndarray, "moment 3"]) -> Float[np.ndarray, "moment 3"]:
        """The same way on the map, no lower and no higher than the ground below it allows."""
        low, high = self.problem.obstacles.span_m(path_m[:, :2], self.problem.keep_out_m)
        up = np.where(low <= high, np.clip(path_m[:, 2], low, high), 0.5 * (low + high))
        up = np.clip(up, self.problem.workspace.box_min_m[2], self.problem.workspace.box_max_m[2])
        return np.column_stack([path_m[:, :2], up])

    def _free_along(
        self, path_m: Float[np.ndarray, "moment 3"], heading_rad: Float[np.ndarray, "moment"] | None = None
    ) -> Float[np.ndarray, "free axis"]:
        control = spline_from_path(path_m, self.problem, self.segments)
        free = np.clip(free_from_control(self.problem.workspace.unit_from_enu(control)), 0.0, 1.0)
        if heading_rad is None:
            return free
        turns = heading_spline(heading_rad, self.segments)[:, None] / TURN_RAD
        return np.concatenate([free, free_from_control(turns)], axis=1)
