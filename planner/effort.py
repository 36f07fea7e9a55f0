"""From probability to effort: where a searcher should spend time to find the most.

Time in proportion to probability is not the best search: a place that was swept gains little by staying. What e sweeps
of a place find is 1 − (1 − d)^e = 1 − exp(−κe), d being what one sweep finds (Koopman). An orderly search sweeps each
part of a place once before it sweeps any part twice, so with less than one sweep it finds b(e) = d·e, and only then by
that law. This b is concave, so the most is found by water-filling: as much effort everywhere as brings the gain of the
next sweep, p(x)·b′(e), down to one level ν, with ν set by the area that can be swept (Stone, Theory of Optimal Search,
ch. 2):

e(x) = 0 where p·d ≤ ν, else 1 + max(0, log(p·(1 − d)·κ/ν))/κ.

A perfect sensor (d → 1) so looks once at the best area it can sweep; one that sees little (d → 0) spends Koopman's
log(p/ν)/κ.

| symbol | identifier              | unit  | shape   |
|--------|-------------------------|-------|---------|
| p      | `DensityGrid.mass`      | 1     | nx ny nz|
| e      | sweeps                  | 1     | nx ny   |
| d      | `detection_probability` | 1     |         |
| κ      | `detection_rate()`      | 1     |         |
| ν      | found by bisection      | 1     |         |

The ground is seen from any altitude, so sweeps are counted over the map; each column of cells keeps its own share of
altitudes.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float

from planner.information import DensityGrid

BISECTIONS = 80
MOST_PLACES = 2_000_000
SURE = 0.999
"""A perfect sensor counts as this one: its κ is finite."""


@dataclasses.dataclass(frozen=True)
class Search:
    """A search for something that the prior says where to look for.

    Attributes:
        prior: Probability of where it is; its cells are no larger than what is seen at once.
        detection_radius_m: Radius of the disc on the ground that is seen.
        detection_probability: d: of what is swept once, the share that is noticed.

    Raises:
        ValueError: A radius that is not positive, or a probability outside (0, 1].
    """

    prior: DensityGrid
    detection_radius_m: float
    detection_probability: float

    def __post_init__(self) -> None:
        if not self.detection_radius_m > 0.0:
            raise ValueError(f"detection_radius_m must be positive, got {self.detection_radius_m}")
        detection_rate(self.detection_probability)

    @property
    def rate(self) -> float:
        """κ."""
        return detection_rate(self.detection_probability)

    def effort(self, length_m: float) -> DensityGrid:
        """Where a path of so many metres should spend its time."""
        swept_m2 = 2.0 * self.detection_radius_m * length_m
        return optimal_effort(self.prior, swept_m2, self.detection_probability)

    def after(self, searched_m: Float[np.ndarray, "time 3"]) -> Search:
        """The search that is left where flying these positions has found nothing."""
        if len(searched_m) < 2:
            return self
        sweeps = sweeps_of(self.prior, searched_m, self.detection_radius_m)
        return dataclasses.replace(self, prior=unseen(self.prior, sweeps, self.rate))

    def probability_found(self, searched_m: Float[np.ndarray, "time 3"]) -> float:
        """Probability that flying these positions finds it, if it is in the box at all."""
        sweeps = sweeps_of(self.prior, searched_m, self.detection_radius_m)
        return probability_found(self.prior, sweeps, self.rate)


def detection_rate(detection_probability: float) -> float:
    """κ of a sensor that notices with a given probability in one sweep.

    Args:
        detection_probability: In (0, 1]; a perfect sensor counts as `SURE`.
    """
    if not 0.0 < detection_probability <= 1.0:
        raise ValueError(f"detection_probability must be in (0, 1], got {detection_probability}")
    return float(-np.log1p(-min(detection_probability, SURE)))


def optimal_effort(information: DensityGrid, swept_area_m2: float, detection_probability: float) -> DensityGrid:
    """The share of time each place should get.

    Args:
        information: Probability of where the target is.
        swept_area_m2: Swath times the length of the path that is left.
        detection_probability: d.

    Raises:
        ValueError: An area that is not positive, or a probability outside (0, 1].
    """
    rate = detection_rate(detection_probability)
    if not swept_area_m2 > 0.0:
        raise ValueError(f"swept_area_m2 must be positive, got {swept_area_m2}")
    column = information.map_mass
    cell_m2 = float(information.cell_m[0] * information.cell_m[1])
    first = np.where(column > 0.0, column, 1.0) * min(detection_probability, SURE)
    first = np.where(column > 0.0, np.log(first), -np.inf)
    # From the gain of a first sweep to that of a second.
    drop = np.log(min(detection_probability, SURE) / ((1.0 - min(detection_probability, SURE)) * rate))

    def sweeps_down_to(level: float) -> Float[np.ndarray, "nx ny"]:
        return np.where(first > level, 1.0 + np.maximum(first - drop - level, 0.0) / rate, 0.0)

    high = float(first.max())
    low = high - drop - rate * swept_area_m2 / cell_m2 - 1.0
    for _ in range(BISECTIONS):
        level = 0.5 * (low + high)
        area = cell_m2 * float(sweeps_down_to(level).sum())
        low, high = (level, high) if area > swept_area_m2 else (low, level)
    share = np.divide(
        information.mass, column[:, :, None], out=np.zeros_like(information.mass), where=information.mass > 0
    )
    return dataclasses.replace(information, mass=sweeps_down_to(low)[:, :, None] * share)


def sweeps_of(
    information: DensityGrid, position_m: Float[np.ndarray, "time 3"], detection_radius_m: float
) -> Float[np.ndarray, "nx ny"]:
    """How often a path swept each column of cells.

    A disc of radius R that moves by s covers a point for a mean chord of πR/2, so each step adds 2s/(πR) to all in it:
    one straight pass is one sweep on the average over its swath.

    Args:
        information: Its grid is used.
        position_m: The path, dense enough that steps are short against R; longer ones than R are gaps, in which nothing
            was seen.
        detection_radius_m: R.
    """
    counts, cell = information.mass.shape[:2], information.cell_m[:2]
    middles = 0.5 * (position_m[1:, :2] + position_m[:-1, :2])
    steps = np.linalg.norm(np.diff(position_m[:, :2], axis=0), axis=1)
    steps = np.where(steps <= detection_radius_m, steps, 0.0)
    reach = np.ceil(detection_radius_m / cell).astype(int) + 1
    window = [np.arange(-cells, cells + 1) for cells in reach]
    found = np.zeros(counts[0] * counts[1])
    # So many moments at once that what they see fits into memory.
    portion = max(1, MOST_PLACES // (len(window[0]) * len(window[1])))
    for begin in range(0, len(middles), portion):
        at = middles[begin : begin + portion] - information.workspace.box_min_m[:2]
        cells, away, inside = [], [], []
        for axis in range(2):
            cells.append((at[:, axis, None] / cell[axis]).astype(int) + window[axis])
            away.append((cells[axis] + 0.5) * cell[axis] - at[:, axis, None])
            inside.append((cells[axis] >= 0) & (cells[axis] < counts[axis]))
        seen = away[0][:, :, None] ** 2 + away[1][:, None, :] ** 2 <= detection_radius_m**2
        seen &= inside[0][:, :, None] & inside[1][:, None, :]
        moment, first, second = np.nonzero(seen)
        place = cells[0][moment, first] * counts[1] + cells[1][moment, second]
        weight = steps[begin + moment] * (2.0 / (np.pi * detection_radius_m))
        found += np.bincount(place, weight, minlength=len(found))
    return found.reshape(counts)


def unseen(information: DensityGrid, sweeps: Float[np.ndarray, "nx ny"], rate: float) -> DensityGrid:
    """What is still probable where a search found nothing: p·exp(−κe), normalised."""
    return dataclasses.replace(information, mass=information.mass * np.exp(-rate * sweeps)[:, :, None])


def probability_found(information: DensityGrid, sweeps: Float[np.ndarray, "nx ny"], rate: float) -> float:
    """Probability that a search with these sweeps has found the target: Σ p (1 − exp(−κe))."""
    return float((information.map_mass * -np.expm1(-rate * sweeps)).sum())
