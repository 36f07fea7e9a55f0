"""The kernel ergodic metric (KES: Fast Ergodic Search with Kernel Functions, Sun et al.), for places and for poses.

E = ∫ p·P − 2 Σ_t w_t P(x_t) + Σ_t Σ_s w_t w_s g_θ(x_t, x_s), g_θ the normalised normal density of variance θ, P the
information's density. Linear in the number of axes, quadratic in the samples; the heading, where there is one, is the
last axis and wraps around (R³ × S¹).

| symbol | identifier       | unit        | shape      |
|--------|------------------|-------------|------------|
| x_t    | `points`         | unit (, rad)| time axis  |
| w_t    | `time_weight`    | 1           | time       |
| θ      | `variance`       | unit², rad² | axis       |
| P      | `attraction`     | 1/unit^axes |            |

Departures from the paper:

1. P is p blurred by g_θ where the paper has p itself (`Attraction.AS_PRINTED`). Then E is a squared distance of
   measures (maximum mean discrepancy): it is never negative and least at p. As printed, a uniform p does not attract
   inside the box while the path's own repulsion drives it to the walls.
2. With memory: what was covered takes part in both sums with its share of the whole time. In a receding horizon it is
   the mean of the splines that P is made of (`KernelMetric.with_covered`), which does not grow with the flight.
"""

from __future__ import annotations

import dataclasses
import enum
import itertools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from planner.density_field import (
    EveryHeading,
    GridField,
    SampleField,
    density_at,
    density_at_centers,
    grid_field,
    kernel_sum,
)
from planner.information import DensityGrid
from planner.kernel_variance import select_variance, silverman_variance
from planner.problem import Covered
from planner.single_precision import single

IGNORED_VARIANCE = 1.0 / (2.0 * np.pi)
"""Of an axis that does not count: there the normal density of a difference of zero is one."""

MOST_COVERED = 1024
PARAMETER_SAMPLES = 256
CELLS_A_WIDTH = 6.0
MOST_CELLS = 2**20


class Attraction(enum.Enum):
    """What draws a path: the density blurred by the kernel, or the density as in the paper."""

    BLURRED = "blurred"
    AS_PRINTED = "as printed"


class KernelMetric(eqx.Module):
    """E of a path in the unit cube, against a density, with memory.

    Attributes:
        attraction: P, value and gradient.
        variance: θ of each axis.
        counts: 1 for the axes that matter, else 0.
        constant: What the path has no part in.
        covered: Poses covered before, shape (sample, axis); places are remembered in `attraction` instead.
        covered_weight: Share of the whole time that each stands for.
        covered_share: Share of the past in the whole time, in [0, 1).
        wraps: Whether the last axis is a heading.
        together: Neighbours in time that are taken together, as their middle; divides the number of samples.
    """

    attraction: GridField | SampleField | EveryHeading
    variance: Float[Array, "axis"]
    counts: Float[Array, "axis"]
    constant: Float[Array, ""]
    covered: Float[Array, "sample axis"]
    covered_weight: Float[Array, "sample"]
    covered_share: Float[Array, ""]
    wraps: bool = eqx.field(static=True)
    together: int = eqx.field(static=True, default=1)

    def __call__(self, points: Float[Array, "time axis"], time_weight: Float[Array, "time"]) -> Float[Array, ""]:
        """E of one path, differentiable in the positions (value and gradient cost one pass).

        Args:
            points: Samples in the unit cube; with a heading in the fourth column where the metric has one.
            time_weight: Share of the path's time that each sample stands for; sums to one.
        """
        weights = time_weight.reshape(-1, self.together)
        weight = jnp.sum(weights, axis=1)
        middles = jnp.einsum("tn,tna->ta", weights / weight[:, None], points.reshape(*weights.shape, -1))
        return _kernel_metric(self, middles * self.counts, weight)

    def basis(self, position_unit: Float[Array, "3"]) -> Float[Array, "n0 n1 n2"]:
        """The splines that P is made of, at one place: what a moment there adds to the memory.

        Raises:
            ValueError: A metric of poses, whose density is on no grid.
        """
        return self._grid().basis(position_unit * self.counts)

    def with_covered(self, mean_basis: Float[Array, "n0 n1 n2"], share: Float[Array, ""]) -> KernelMetric:
        """A metric without memory, with one: E of the whole flight, whatever its length, at the cost of a horizon's.

        All that E needs of the past is the mean of the splines over it, B: the mean of P is P's coefficients times B,
        and the past repels like the density of B blurred by g_θ, which is taken from P. That is as exact as the nodes
        are fine beside the kernel, which they are of a density that is blurred (`Attraction.BLURRED`).

        Args:
            mean_basis: Mean of `basis` over what was flown.
            share: Share of that in the whole time, in [0, 1).

        Raises:
            ValueError: A metric of poses.
        """
        field = self._grid()
        past = field.spread(mean_basis, self.variance, self.counts)
        wanted, spent = field.coefficients, share * past.coefficients
        return dataclasses.replace(
            self,
            attraction=dataclasses.replace(field, coefficients=wanted - spent),
            constant=self.constant + share * jnp.vdot(mean_basis, spent - 2.0 * wanted),
            covered_share=share,
        )

    def _grid(self) -> GridField:
        if not isinstance(self.attraction, GridField):
            raise ValueError(
                "only a metric of places remembers by a basis, and this one is of poses: use kernel_metric"
            )
        return self.attraction


def kernel_metric(
    information: DensityGrid,
    *,
    attraction: Attraction = Attraction.BLURRED,
    counts: tuple[bool, bool, bool] = (True, True, True),
    variance_unit2: Float[np.ndarray, "3"] | None = None,
    covered: Covered | None = None,
    duration_s: float = 1.0,
    seed: int = 0,
) -> KernelMetric:
    """The metric of places (R³) for information on a grid.

    Args:
        information: Where time should be spent.
        attraction: What draws a path.
        counts: Which axes matter (as modes above one do in the spectral metric).
        variance_unit2: θ; None: by KES eq. (30) on samples of the information.
        covered: What was flown before, remembered as the time spent in each cell of a grid.
        duration_s: Time of the path that will be measured; only its ratio to the covered time matters.
        seed: Of the samples.

    Raises:
        ValueError: No axis counts, memory for the metric as printed, or no places of what was covered.
    """
    if not any(counts):
        raise ValueError("a metric needs an axis that counts, got none")
    mask = np.array(counts)
    plain = grid_field(information.mass, counts=counts)
    variance = np.full(3, IGNORED_VARIANCE)
    if variance_unit2 is None:
        samples = sampled(information, PARAMETER_SAMPLES, np.random.default_rng(seed))
        slope = np.asarray(density_at(plain, single(samples))[1], dtype=float)
        variance[mask] = select_variance(samples[:, mask], slope[:, mask], wraps=False)
    else:
        variance[mask] = np.asarray(variance_unit2, dtype=float)[mask]
    blur = None if attraction is Attraction.AS_PRINTED else variance
    share, wanted = 0.0, information.mass if blur is None else _refined(information.mass, np.sqrt(blur), mask)
    if covered is not None:
        if attraction is Attraction.AS_PRINTED:
            raise ValueError("the metric as printed has no memory: use Attraction.BLURRED, or no covered path")
        if covered.places is None or not len(covered.places):
            raise ValueError("this metric has no basis, and what was covered before has no places: give Covered.places")
        share = covered.duration_s / (covered.duration_s + duration_s)
        wanted = wanted - share * _time_in_cells(covered.places, wanted.shape)
    return KernelMetric(
        attraction=plain if blur is None else grid_field(wanted, blur, counts),
        variance=single(variance),
        counts=single(mask),
        constant=single(np.sum(wanted * density_at_centers(wanted, blur, counts))),
        covered=single(np.zeros((0, 3))),
        covered_weight=single(np.zeros(0)),
        covered_share=single(share),
        wraps=False,
    )


def _refined(
    mass: Float[np.ndarray, "nx ny nz"], width: Float[np.ndarray, "3"], counts: Bool[np.ndarray, "3"]
) -> Float[np.ndarray, "mx my mz"]:
    """The same density in cells that a kernel of this width hardly tells from points; one along what does not count."""
    mass = mass.sum(axis=tuple(np.flatnonzero(~counts)), keepdims=True)
    most = MOST_CELLS ** (1.0 / counts.sum())
    for axis in np.flatnonzero(counts):
        cells = mass.shape[axis]
        parts = max(1, min(math.ceil(CELLS_A_WIDTH / width[axis] / cells), int(most / cells)))
        mass = np.repeat(mass / parts, parts, axis=axis)
    return mass


def _time_in_cells(places: Float[np.ndarray, "sample 3"], shape: tuple[int, ...]) -> Float[np.ndarray, "nx ny nz"]:
    """The share of the time in each cell of a grid that fills the cube; a place is shared out among its neighbours."""
    cells = np.array(shape)
    behind = np.clip(places * cells - 0.5, 0.0, cells - 1.0)
    first = np.minimum(behind.astype(int), np.maximum(cells - 2, 0))
    ahead = behind - first
    spent = np.zeros(cells.prod())
    for corner in itertools.product((0, 1), repeat=3):
        weight = np.prod(np.where(corner, ahead, 1.0 - ahead), axis=1)
        index = np.ravel_multi_index(tuple(np.minimum(first + corner, cells - 1).T), shape)
        spent += np.bincount(index, weight, minlength=len(spent))
    return spent.reshape(shape) / len(places)


def pose_metric(
    samples: Float[np.ndarray, "sample 4"],
    weight: Float[np.ndarray, "sample"],
    *,
    attraction: Attraction = Attraction.BLURRED,
    variance: Float[np.ndarray, "4"] | None = None,
    covered: Float[np.ndarray, "sample 4"] | None = None,
    covered_share: float = 0.0,
) -> KernelMetric:
    """The metric of poses (R³ × S¹) for information given as weighted poses.

    The density is the mixture of normal densities around them, as wide as Silverman's rule says.

    Args:
        samples: Place in the unit cube and heading in radians.
        weight: Not negative, not all zero.
        attraction: What draws a path.
        variance: θ, unit² and rad²; None: by KES eq. (30) on the samples.
        covered: Poses flown before, equally long apart.
        covered_share: Their share of the whole time.

    Raises:
        ValueError: Weights that do not weigh, or a share of the past without poses or not in [0, 1).
    """
    if not 0.0 <= covered_share < 1.0 or (covered_share > 0.0 and (covered is None or len(covered) == 0)):
        raise ValueError(f"a share of the past lies in [0, 1) and needs poses, got {covered_share}")
    share = np.asarray(weight, dtype=float)
    if (share < 0.0).any() or not share.sum() > 0.0:
        raise ValueError("poses need weights that are not negative and not all zero")
    share = share / share.sum()
    poses = np.asarray(samples, dtype=float)
    width = silverman_variance(poses, share, wraps=True)
    plain = _sample_field(poses, share, width, wraps=True)
    if variance is None:
        slope = np.asarray(density_at(plain, plain.centers)[1], dtype=float)
        theta = select_variance(poses, slope, wraps=True, weight=share)
    else:
        theta = np.asarray(variance, dtype=float)
    # Normal densities blur each other by adding their variances.
    field = plain if attraction is Attraction.AS_PRINTED else _sample_field(poses, share, width + theta, wraps=True)
    spread = _sample_field(poses, share, width + np.asarray(field.variance), wraps=True)
    own = float(np.dot(np.asarray(density_at(spread, spread.centers)[0]), share))
    past = np.zeros((0, 4)) if covered is None or covered_share == 0.0 else np.asarray(covered, dtype=float)
    past = thinned(past, MOST_COVERED)
    each = np.full(len(past), covered_share / max(len(past), 1))
    return of_poses(field, theta, np.ones(4, dtype=bool), own, past, each, covered_share)


def thinned(poses: Float[np.ndarray, "sample 4"], most: int) -> Float[np.ndarray, "kept 4"]:
    """No more poses than that, evenly chosen."""
    if len(poses) <= most:
        return poses
    return poses[np.round(np.linspace(0, len(poses) - 1, most)).astype(int)]


def of_poses(
    attraction: SampleField | EveryHeading,
    theta: Float[np.ndarray, "4"],
    counts: Bool[np.ndarray, "4"],
    own: float,
    past: Float[np.ndarray, "sample 4"],
    weight: Float[np.ndarray, "sample"],
    covered_share: float,
) -> KernelMetric:
    """The metric of poses from its density, ∫p·P, and the poses that were flown before."""
    flown, each = single(past), single(weight)
    if len(past) > 0:
        mutual, wanted = (
            np.asarray(density_at(field, flown)[0], dtype=float)
            for field in (_sample_field(past, weight, theta, wraps=True), attraction)
        )
        own += float(weight @ (mutual - 2.0 * wanted))
    return KernelMetric(
        attraction=attraction,
        variance=single(theta),
        counts=single(counts),
        constant=single(own),
        covered=flown,
        covered_weight=each,
        covered_share=single(covered_share),
        wraps=True,
    )


def sampled(information: DensityGrid, count: int, generator: np.random.Generator) -> Float[np.ndarray, "sample 3"]:
    """Random places (unit cube) drawn from a density."""
    mass = information.mass.ravel()
    cells = generator.choice(len(mass), size=count, p=mass / mass.sum())
    index = np.stack(np.unravel_index(cells, information.mass.shape), axis=-1)
    return (index + generator.uniform(size=(count, 3))) / np.array(information.mass.shape)


def _sample_field(
    poses: Float[np.ndarray, "sample axis"], share: np.ndarray, variance: np.ndarray, wraps: bool
) -> SampleField:
    return SampleField(single(poses), single(share), single(variance), wraps=wraps)


@jax.custom_vjp
def _kernel_metric(
    metric: KernelMetric, points: Float[Array, "time axis"], time_weight: Float[Array, "time"]
) -> Float[Array, ""]:
    return _forward(metric, points, time_weight)[0]


def _forward(metric, points, time_weight):  # noqa: ANN001 (custom_vjp's own signature)
    share = (1.0 - metric.covered_share) * time_weight
    pull, pull_slope = metric.attraction(points)
    push, push_slope = kernel_sum(points, points, share, metric.variance, metric.wraps)
    if metric.covered.shape[0] > 0:
        past, past_slope = kernel_sum(points, metric.covered, metric.covered_weight, metric.variance, metric.wraps)
        push, push_slope = push + 2.0 * past, push_slope + past_slope
    value = metric.constant + jnp.dot(share, push - 2.0 * pull)
    gradient = 2.0 * share[:, None] * (push_slope - pull_slope)
    return value, (gradient, metric, time_weight)


def _backward(saved, cotangent):  # noqa: ANN001 (custom_vjp's own signature)
    gradient, metric, time_weight = saved
    # Only positions are optimised: density, variance and times are data.
    return jax.tree.map(jnp.zeros_like, metric), cotangent * gradient, jnp.zeros_like(time_weight)


_kernel_metric.defvjp(_forward, _backward)
