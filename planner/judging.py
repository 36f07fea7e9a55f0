"""From a curve to a candidate: measured in double precision, shown to the gate."""

from __future__ import annotations

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from planner import gate
from planner.accelerator import with_exact_products
from planner.kernel_metric import KernelMetric
from planner.kernel_metric_of import metric_of
from planner.plan import Candidate, objective_of
from planner.polyline import densified
from planner.problem import Covered, Metric, Options, Problem
from planner.single_precision import single
from planner.spectral_metric import mean_basis, mode_weights
from planner.trajectory import Samples, Trajectory
from planner.yaw import along_travel

# Samples on each segment when a metric is reported.
REPORT_SAMPLES = 4
# What a whole flight at the acceleration limit adds to the cost: enough to choose between equal coverages, not enough
# to give any up.
SMOOTHNESS_WEIGHT = 1e-6
# Of the detection radius: how far apart the places are that make up what is seen from a path.
LOOK_SHARE = 0.25


class Judge:
    """Measures curves for one problem: target, weights and memory are made once."""

    def __init__(self, problem: Problem, options: Options) -> None:
        self._problem = problem
        self._modes = options.modes
        self._target = problem.information.coefficients(options.modes)
        self._weights = mode_weights(options.modes, options.metric_weights)
        self._by_kernel = metric_of(problem, options) if options.metric is Metric.KERNEL else None
        self._of_poses = options.explores_headings

    def ergodic_metric(
        self, position_m: Float[np.ndarray, "time 3"], heading_rad: Float[np.ndarray, "time"] | None = None
    ) -> float:
        """E of a path that takes the problem's time, with what was covered before.

        Args:
            position_m: Positions at equally long moments, shape (time, 3), metres.
            heading_rad: Headings at those moments, which count where headings are explored; None: the direction of
                travel, of a vehicle that turns as fast as it likes.
        """
        problem = self._problem
        unit = problem.workspace.unit_from_enu(position_m)
        if self._by_kernel is not None:
            if self._of_poses:
                unit = np.column_stack([unit, along_travel(position_m) if heading_rad is None else heading_rad])
            return float(_measured(self._by_kernel, single(unit), single(np.full(len(unit), 1.0 / len(unit)))))
        mean = mean_basis(unit, np.full(len(unit), 1.0 / len(unit)), self._modes)
        covered: Covered | None = problem.covered
        if covered is not None:
            share = covered.duration_s / (covered.duration_s + problem.duration_s)
            mean = share * covered.mean_basis + (1.0 - share) * mean
        return float(np.sum(self._weights * (mean - self._target) ** 2))

    def probability_found(self, position_m: Float[np.ndarray, "time 3"]) -> float | None:
        """Of a search, that a path finds what it looks for where nothing was found before; None: it is no search."""
        search = self._problem.search
        if search is None:
            return None
        return search.probability_found(densified(position_m, LOOK_SHARE * search.detection_radius_m))

    def objective(
        self, position_m: Float[np.ndarray, "time 3"], heading_rad: Float[np.ndarray, "time"] | None = None
    ) -> float:
        """What `Candidate.objective` is, of any path that takes the problem's time."""
        return objective_of(self.ergodic_metric(position_m, heading_rad), self.probability_found(position_m))

    def candidate(self, trajectory: Trajectory, seed_pattern: str) -> Candidate:
        """The curve with its metric, its cost, and its proof or why there is none."""
        refusal = None
        try:
            trajectory = gate.prove(trajectory, self._problem)
        except gate.GateRefused as refused:
            refusal = refused.report
        samples = at_middles(trajectory)
        metric = self.ergodic_metric(samples.position_m, trajectory.headings_at(samples.time_s))
        effort = float(
            np.mean(np.sum(samples.acceleration_mps2**2, axis=1)) / self._problem.limits.max_acceleration_mps2**2
        )
        found = self.probability_found(samples.position_m)
        return Candidate(
            trajectory=trajectory,
            seed_pattern=seed_pattern,
            cost=objective_of(metric, found) + SMOOTHNESS_WEIGHT * effort,
            ergodic_metric=metric,
            refusal=refusal,
            probability_found=found,
        )


def at_middles(trajectory: Trajectory) -> Samples:
    """A curve at the middles of equal pieces, each standing for the same time."""
    count = trajectory.segments * REPORT_SAMPLES
    return trajectory.sample(trajectory.start_s + (np.arange(count) + 0.5) * trajectory.duration_s / count)


def better(first: Candidate, second: Candidate) -> Candidate:
    """Whichever of two versions of a candidate to keep: proven before refused, then the lower cost."""
    if first.feasible != second.feasible:
        return first if first.feasible else second
    return second if second.cost < first.cost else first


@eqx.filter_jit
@with_exact_products
def _measured(
    metric: KernelMetric, position_unit: Float[Array, "time axis"], time_weight: Float[Array, "time"]
) -> Float[Array, ""]:
    return metric(position_unit, time_weight)
