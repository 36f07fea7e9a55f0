"""The kernel metric that a problem is solved with: of its places, or of poses where headings are explored."""

from __future__ import annotations

import dataclasses

import numpy as np

from planner.density_field import EveryHeading, density_at, density_at_centers, grid_field
from planner.kernel_metric import (
    IGNORED_VARIANCE,
    PARAMETER_SAMPLES,
    KernelMetric,
    kernel_metric,
    of_poses,
    sampled,
    thinned,
)
from planner.kernel_variance import select_variance
from planner.problem import Options, Problem
from planner.single_precision import single

REMEMBERED_POSES = 512
"""Of a flight under way always as many, so that code that was compiled serves all of it."""
SPAN_OF_WIDTH = 0.75


def metric_of(problem: Problem, options: Options, samples: int = 1) -> KernelMetric:
    """The metric that a problem is solved with: of places, or of poses where headings are explored.

    Args:
        problem: What to explore.
        options: Which axes count, and whether the heading is one of them.
        samples: Of the paths that will be measured.
    """
    wanted = metric_of_poses if options.explores_headings else metric_of_places
    return wanted(problem, options, samples)


def metric_of_places(problem: Problem, options: Options, samples: int = 1) -> KernelMetric:
    """The metric of a problem: axes with one mode are left out, as in the spectral metric.

    Args:
        problem: What to explore.
        options: Which axes count.
        samples: Of the paths that will be measured. Where they lie closer than the kernel can tell apart, neighbours
            are taken together, which saves its square in time.
    """
    metric = kernel_metric(
        problem.information,
        counts=_counts(options),
        covered=problem.covered,
        duration_s=problem.duration_s,
        seed=options.seed,
    )
    return dataclasses.replace(metric, together=_neighbours_together(problem, metric, samples))


def metric_of_poses(problem: Problem, options: Options, samples: int = 1) -> KernelMetric:
    """The metric of poses (R³ × S¹) of a problem: its information, looked at from every side alike.

    Args:
        problem: What to explore.
        options: Which axes of the place count.
        samples: As in `metric_of_places`.

    Raises:
        ValueError: Of what was covered before only the places are known.
    """
    information, covered, counts = problem.information, problem.covered, _counts(options)
    mask = np.array([*counts, True])
    generator = np.random.default_rng(options.seed)
    around = 2.0 * np.pi * (generator.permutation(PARAMETER_SAMPLES) + 0.5) / PARAMETER_SAMPLES
    poses = np.column_stack([sampled(information, PARAMETER_SAMPLES, generator), around])
    plain = EveryHeading(grid_field(information.mass, counts=counts))
    slope = np.asarray(density_at(plain, single(poses))[1], dtype=float)
    variance = np.full(4, IGNORED_VARIANCE)
    variance[mask] = select_variance(poses[:, mask], slope[:, mask], wraps=True)
    blurred = EveryHeading(grid_field(information.mass, variance[:3], counts))
    own = np.sum(information.mass * density_at_centers(information.mass, variance[:3], counts)) / (2.0 * np.pi)
    past, each, share = np.zeros((0, 4)), np.zeros(0), 0.0
    if covered is not None:
        if covered.poses is None or not len(covered.poses):
            raise ValueError("headings are explored, and what was covered before has no poses: give Covered.poses")
        share = covered.duration_s / (covered.duration_s + problem.duration_s)
        past = thinned(covered.poses * mask, REMEMBERED_POSES)
        missing = REMEMBERED_POSES - len(past)
        each = np.append(np.full(len(past), share / max(len(past), 1)), np.zeros(missing))
        past = np.concatenate([past, np.zeros((missing, 4))])
    metric = of_poses(blurred, variance, mask, float(own), past, each, share)
    return dataclasses.replace(metric, together=_neighbours_together(problem, metric, samples))


def _counts(options: Options) -> tuple[bool, bool, bool]:
    first, second, third = (modes > 1 for modes in options.modes)
    return first, second, third


def _neighbours_together(problem: Problem, metric: KernelMetric, samples: int) -> int:
    """The largest power of two that divides the samples and spans at most `SPAN_OF_WIDTH` of the kernel's width."""
    limits = problem.limits
    climb_mps = min(limits.max_speed_mps, max(limits.max_climb_mps, limits.max_descent_mps))
    speed_per_s = np.array([limits.max_speed_mps, limits.max_speed_mps, climb_mps]) / problem.workspace.lengths_m
    if metric.wraps:
        speed_per_s = np.append(speed_per_s, limits.max_yaw_rate_radps)
    spacing = speed_per_s * problem.duration_s / samples
    width = np.sqrt(np.asarray(metric.variance))
    counts = np.asarray(metric.counts) > 0.0
    together = 1
    while samples % (2 * together) == 0 and (2 * together * spacing <= SPAN_OF_WIDTH * width)[counts].all():
        together *= 2
    return together
