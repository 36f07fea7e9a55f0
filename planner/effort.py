"""From probability to effort: where a searcher should spend time to find the most.

Time in proportion to probability is not the best search: a place that was swept gains little by staying. For the
exponential detection function b(e) = 1 − exp(−κe) of e sweeps, the most is found by Koopman's and Stone's
water-filling, e(x) = max(0, log(p(x)/ν))/κ with ν set by the area that can be swept (Stone, Theory of Optimal Search,
ch. 2).

| symbol | identifier           | unit  | shape   |
|--------|----------------------|-------|---------|
| p      | `DensityGrid.mass`   | 1     | nx ny nz|
| e      | sweeps               | 1     | nx ny   |
| κ      | `detection_rate`     | 1     |         |
| ν      | found by bisection   | 1     |         |

The ground is seen from any altitude, so sweeps are counted over the map; each column of cells keeps its own share of
altitudes.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float

from planner.information import DensityGrid

BISECTIONS = 80


@dataclasses.dataclass(frozen=True)
class Search:
    """A search for something that the prior says where to look for.

    Attributes:
        prior: Probability of where it is, before anything was searched.
        detection_radius_m: Radius of the disc on the ground that is seen.
        rate: κ.

    Raises:
        ValueError: A radius or rate that is not positive.
    """

    prior: DensityGrid
    detection_radius_m: float
    rate: float

    def __post_init__(self) -> None:
        if not (self.detection_radius_m > 0.0 and self.rate > 0.0):
            raise ValueError(f"radius and rate must be positive, got {self.detection_radius_m} m and {self.rate}")

    def effort(self, searched_m: Float[np.ndarray, "time 3"], remaining_m: float) -> DensityGrid:
        """Where the rest of a path should spend its time.

        Args:
            searched_m: Positions flown so far (none: shape (0, 3)).
            remaining_m: Length of path that is left.
        """
        left = self.prior
        if len(searched_m) > 1:
            left = unseen(left, sweeps_of(left, searched_m, self.detection_radius_m), self.rate)
        return optimal_effort(left, 2.0 * self.detection_radius_m * remaining_m, self.rate)

    def probability_found(self, searched_m: Float[np.ndarray, "time 3"]) -> float:
        """Probability that flying these positions finds it, if it is in the box at all."""
        sweeps = sweeps_of(self.prior, searched_m, self.detection_radius_m)
        return probability_found(self.prior, sweeps, self.rate)


def detection_rate(detection_probability: float) -> float:
    """κ of a sensor that notices with a given probability in one sweep.

    Args:
        detection_probability: In (0, 1]; a perfect sensor counts as 0.999.
    """
    if not 0.0 < detection_probability <= 1.0:
        raise ValueError(f"detection_probability must be in (0, 1], got {detection_probability}")
    return float(-np.log1p(-min(detection_probability, 0.999)))


def optimal_effort(information: DensityGrid, swept_area_m2: float, rate: float) -> DensityGrid:
    """The share of time each place should get.

    Args:
        information: Probability of where the target is.
        swept_area_m2: Swath times the length of the path that is left.
        rate: κ.

    Raises:
        ValueError: An area or rate that is not positive.
    """
    if not (swept_area_m2 > 0.0 and rate > 0.0):
        raise ValueError(f"swept_area_m2 and rate must be positive, got {swept_area_m2} and {rate}")
    column = information.mass.sum(axis=2)
    cell_m2 = float(information.cell_m[0] * information.cell_m[1])
    logs = np.log(np.where(column > 0.0, column, 1.0))
    logs = np.where(column > 0.0, logs, -np.inf)
    high = float(logs.max())
    low = high - rate * swept_area_m2 / cell_m2 - 1.0
    for _ in range(BISECTIONS):
        level = 0.5 * (low + high)
        area = cell_m2 * float(np.maximum(logs - level, 0.0).sum()) / rate
        low, high = (level, high) if area > swept_area_m2 else (low, level)
    sweeps = np.maximum(logs - low, 0.0)
    share = np.divide(
        information.mass, column[:, :, None], out=np.zeros_like(information.mass), where=information.mass > 0
    )
    return dataclasses.replace(information, mass=sweeps[:, :, None] * share)


def sweeps_of(
    information: DensityGrid, position_m: Float[np.ndarray, "time 3"], detection_radius_m: float
) -> Float[np.ndarray, "nx ny"]:
    """How often a path swept each column of cells.

    A disc of radius R that moves by s covers a point for a mean chord of πR/2, so each step adds 2s/(πR) to all in it:
    one straight pass is one sweep on the average over its swath.

    Args:
        information: Its grid is used.
        position_m: The path, dense enough that steps are short against R.
        detection_radius_m: R.
    """
    centers = information.centers_m()[:, :, 0, :2]
    found = np.zeros(centers.shape[:2])
    steps = np.linalg.norm(np.diff(position_m[:, :2], axis=0), axis=1)
    cell = information.cell_m[:2]
    low = information.workspace.box_min_m[:2]
    reach = np.ceil(detection_radius_m / cell).astype(int) + 1
    for middle, step in zip(0.5 * (position_m[1:, :2] + position_m[:-1, :2]), steps, strict=True):
        at = ((middle - low) / cell).astype(int)
        window = tuple(slice(max(0, at[axis] - reach[axis]), max(0, at[axis] + reach[axis] + 1)) for axis in range(2))
        inside = np.sum((centers[window] - middle) ** 2, axis=-1) <= detection_radius_m**2
        found[window] += inside * (2.0 * step / (np.pi * detection_radius_m))
    return found


def unseen(information: DensityGrid, sweeps: Float[np.ndarray, "nx ny"], rate: float) -> DensityGrid:
    """What is still probable where a search found nothing: p·exp(−κe), normalised."""
    return dataclasses.replace(information, mass=information.mass * np.exp(-rate * sweeps)[:, :, None])


def probability_found(information: DensityGrid, sweeps: Float[np.ndarray, "nx ny"], rate: float) -> float:
    """Probability that a search with these sweeps has found the target: Σ p (1 − exp(−κe))."""
    return float((information.mass.sum(axis=2) * -np.expm1(-rate * sweeps)).sum())
