"""What a path leaves undone as a search: what optimal effort could find, less what the path finds.

E_d = B − Σ_x p(x) (1 − exp(−βe(x))), e(x) = Σ_t s_t · 2R · g(x − x_t): how often each cell is swept (`planner.effort`),
as a smooth function of the path. The ergodic metric of the optimal effort leads a path to where it should be; this one
then moves it so that it finds the most: rows apart by a swath, nothing swept twice that is not worth it.

| symbol | identifier    | unit | shape  |
|--------|---------------|------|--------|
| p      | `probability` | 1    | nx ny  |
| s_t    | length of a step of the path | m | time |
| R      | `radius_m`    | m    |        |
| β      | `rate`        | 1    |        |
| B      | `most_found`  | 1    |        |

What makes it cheap, and smooth enough to descend:

1. The disc that is seen is taken for a square of the same area with sloping edges, averaged over each cell. It is then
   a product, and e is one matrix product, C_0 · diag(s) · C_1ᵀ.
2. β is κ, but no more than that of a sensor that notices eight of ten: what is sharper has no slope left to descend
   where something was swept once.
3. B bounds E_d from below by zero: no effort of the same area finds more by the same law, wherever it is put.
4. Samples much closer than a radius are left out, and cells much finer than one taken together.
5. Its derivative is written out: two more products, a ninth of the time that differentiating the tables takes.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from planner.effort import Search, detection_rate
from planner.single_precision import single

SHARPEST = 0.8
"""Detection probability that β stands for at most."""
# Of R: width of the sloping edge, longest group of cells, longest step between samples.
EDGE_SHARE = 0.5
GROUP_SHARE = 2.0 / 3.0
STEP_SHARE = 0.75
MOST_CELLS = 128
BISECTIONS = 60


class DetectionMetric(eqx.Module):
    """E_d of a path in the unit cube.

    Attributes:
        probability: Probability of the cells, seen from above; sums to one.
        edges_m: Edges of the cells east and north, from the corner of the box.
        lengths_m: Edge lengths of the box.
        radius_m: R.
        rate: β.
        most_found: B.
        stride: Which samples count: every so many.
    """

    probability: Float[Array, "nx ny"]
    edges_m: tuple[Float[Array, "x_edge"], Float[Array, "y_edge"]]
    lengths_m: Float[Array, "3"]
    radius_m: Float[Array, ""]
    rate: Float[Array, ""]
    most_found: Float[Array, ""]
    stride: int = eqx.field(static=True)

    @classmethod
    def of(cls, search: Search, length_m: float, spacing_m: float) -> DetectionMetric:
        """The metric for what a search looks for.

        Args:
            search: What it looks for, and how it sees.
            length_m: Length that a path can have at the most.
            spacing_m: Greatest distance between the samples of a path; which of them count is compiled.
        """
        prior, radius = search.prior, search.detection_radius_m
        column = prior.map_mass
        edges = []
        for axis, cell_m in enumerate(prior.cell_m[:2]):
            cells = column.shape[axis]
            together = max(int(GROUP_SHARE * radius / cell_m + 1e-9), -(-cells // MOST_CELLS), 1)
            firsts = np.arange(0, cells, together)
            column = np.add.reduceat(column, firsts, axis=axis)
            edges.append(np.append(firsts, cells) * cell_m)
        area_m2 = np.outer(*(np.diff(edge) for edge in edges))
        rate = min(search.rate, detection_rate(SHARPEST))
        most_found = _most_found(column, area_m2, 2.0 * radius * length_m, rate)
        return cls(
            probability=single(column),
            edges_m=(single(edges[0]), single(edges[1])),
            lengths_m=single(prior.workspace.lengths_m),
            radius_m=single(radius),
            rate=single(rate),
            most_found=single(most_found),
            stride=max(1, int(STEP_SHARE * radius / spacing_m)),
        )

    def __call__(self, position_unit: Float[Array, "time 3"], time_weight: Float[Array, "time"]) -> Float[Array, ""]:
        """E_d of one path, differentiable in the positions.

        Args:
            position_unit: Samples in the unit cube.
            time_weight: Not used: what is swept goes by the way, not by the time.
        """
        places = (position_unit * self.lengths_m)[:: self.stride, :2]
        steps = jnp.sqrt(jnp.sum(jnp.diff(places, axis=0) ** 2, axis=1) + 1e-6)
        return _left_undone(self, 0.5 * (places[1:] + places[:-1]), steps)

    def seen(
        self, at_m: Float[Array, "time"], edges_m: Float[Array, "edge"]
    ) -> tuple[Float[Array, "cell time"], Float[Array, "cell time"]]:
        """How much of what is seen from each place falls into a cell of one axis.

        Args:
            at_m: Places along the axis.
            edges_m: Edges of its cells.

        Returns:
            Mean over every cell of a box with sloping edges and unit mass about each place, 1/m, and its derivative by
            the place, 1/m².
        """
        half_m, edge_m = 0.5 * np.sqrt(np.pi) * self.radius_m, EDGE_SHARE * self.radius_m
        away = edges_m[:, None] - at_m[None]
        before, behind = (away + half_m) / edge_m, (away - half_m) / edge_m
        # The box is ramp((x + half)/edge) − ramp((x − half)/edge); its mean over a cell is a difference of ∫ramp.
        share = 1.0 / (2.0 * half_m * jnp.diff(edges_m)[:, None])
        mean = jnp.diff(_ramped(before) - _ramped(behind), axis=0) * edge_m * share
        return mean, -jnp.diff(_ramp(before) - _ramp(behind), axis=0) * share


@jax.custom_vjp
def _left_undone(
    metric: DetectionMetric, middle_m: Float[Array, "time 2"], step_m: Float[Array, "time"]
) -> Float[Array, ""]:
    """E_d of steps of given lengths about given places."""
    return _forward(metric, middle_m, step_m)[0]


def _forward(metric, middle_m, step_m):  # noqa: ANN001 (custom_vjp's own signature)
    (east, along_east), (north, along_north) = (
        metric.seen(middle_m[:, axis], edges) for axis, edges in enumerate(metric.edges_m)
    )
    sweep = metric.rate * 2.0 * metric.radius_m
    found = metric.probability * -jnp.expm1(-sweep * ((east * step_m) @ north.T))
    missed = metric.probability - found
    # What another metre from each place would find, cell by cell of one axis.
    by_east, by_north = sweep * (missed @ north), sweep * (missed.T @ east)
    by_step = -jnp.sum(by_east * east, axis=0)
    by_middle = -step_m[:, None] * jnp.stack(
        [jnp.sum(by_east * along_east, axis=0), jnp.sum(by_north * along_north, axis=0)], axis=1
    )
    return metric.most_found - jnp.sum(found), (metric, by_middle, by_step)


def _backward(saved, cotangent):  # noqa: ANN001 (custom_vjp's own signature)
    metric, by_middle, by_step = saved
    # Only the path is optimised: probability and radius are data.
    return jax.tree.map(jnp.zeros_like, metric), cotangent * by_middle, cotangent * by_step


_left_undone.defvjp(_forward, _backward)


def _ramp(u: Float[Array, "..."]) -> Float[Array, "..."]:
    """Rises from 0 to 1 between −½ and ½."""
    return jnp.clip(u + 0.5, 0.0, 1.0)


def _ramped(u: Float[Array, "..."]) -> Float[Array, "..."]:
    """The integral of the ramp."""
    return 0.5 * _ramp(u) ** 2 + jnp.maximum(u - 0.5, 0.0)


def _most_found(
    probability: Float[np.ndarray, "nx ny"], area_m2: Float[np.ndarray, "nx ny"], swept_m2: float, rate: float
) -> float:
    """What the best use of an area finds by 1 − exp(−βe): e = max(0, log(p/ν))/β, p being the density."""
    inside = probability > 0.0
    mass, cell_m2 = probability[inside], area_m2[inside]
    logs = np.log(mass / cell_m2)
    high = float(logs.max())
    low = high - rate * swept_m2 / float(cell_m2[logs.argmax()]) - 1.0
    for _ in range(BISECTIONS):
        level = 0.5 * (low + high)
        used_m2 = float(np.sum(cell_m2 * np.maximum(logs - level, 0.0))) / rate
        low, high = (level, high) if used_m2 > swept_m2 else (low, level)
    return float(np.sum(mass * -np.expm1(-np.maximum(logs - low, 0.0))))
