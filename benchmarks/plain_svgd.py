"""Plain SVGD on waypoints: the recipe of `benchmarks.sves` compiled once for every target of one size."""

from __future__ import annotations

import dataclasses
import functools

import jax
import numpy as np

from benchmarks.gradient import naive_metric
from benchmarks.sves.recipe import Recipe, World, start_set, steps_of, world
from planner.problem import Kernel
from planner.spectral_metric import SpectralMetric

PARTICLES, SAMPLES, SVGD_STEPS = 20, 100, 500


def place_of(metric: SpectralMetric, axes: int) -> World:
    """A free square or cube, crossed from corner to corner by the prior's line."""
    return world(metric, (0.1,) * axes, (0.9,) * axes, SAMPLES)


def random_set(metric: SpectralMetric, axes: int, seed: int) -> np.ndarray:
    """SVES's start set, shape (particle, time, 3), unit cube."""
    return start_set(place_of(metric, axes), PARTICLES, seed)


@functools.partial(jax.jit, static_argnames=("axes", "kernel", "autodiff"))
def plain_svgd(
    metric: SpectralMetric, start: jax.Array, axes: int, *, kernel: Kernel = Kernel.RBF, autodiff: bool = False
) -> jax.Array:
    """The set after all steps, with the corrections without which the recipe finds nothing (`Recipe`'s defaults).

    Args:
        metric: The spectral metric.
        start: Shape (particle, time, 3), unit cube.
        axes: How many are optimised.
        kernel: Between the paths; the identity is independent descent.
        autodiff: Whether the metric is written and differentiated as public code does it; else it is the separable one.
    """
    place = place_of(metric, axes)
    if autodiff:
        naive = naive_metric(metric)
        place = dataclasses.replace(place, metric=lambda path, _: naive(path))
    return steps_of(Recipe(kernel=kernel), place, SVGD_STEPS)(start)
