"""The box that is explored, and its map to the unit cube.

The basis and the distances between candidates live in the unit cube; speed, clearance and acceleration live in metres.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float


@dataclasses.dataclass(frozen=True)
class Workspace:
    """An axis-aligned box in local ENU metres.

    Attributes:
        box_min_m: Lower corner, shape (3,).
        box_max_m: Upper corner, shape (3,).

    Raises:
        ValueError: An axis without extent or a corner that is not finite.
    """

    box_min_m: Float[np.ndarray, "3"]
    box_max_m: Float[np.ndarray, "3"]

    def __post_init__(self) -> None:
        low, high = np.asarray(self.box_min_m, dtype=float), np.asarray(self.box_max_m, dtype=float)
        object.__setattr__(self, "box_min_m", low)
        object.__setattr__(self, "box_max_m", high)
        if low.shape != (3,) or high.shape != (3,) or not np.isfinite([low, high]).all() or (high <= low).any():
            raise ValueError(
                f"a box needs two finite corners with min < max on all three axes, got {low.tolist()} … {high.tolist()}"
            )

    @property
    def lengths_m(self) -> Float[np.ndarray, "3"]:
        """Length of each axis, metres."""
        return self.box_max_m - self.box_min_m

    def unit_from_enu(self, position_m: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
        """Local ENU metres to the unit cube."""
        return (position_m - self.box_min_m) / self.lengths_m

    def enu_from_unit(self, position_unit: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
        """The unit cube to local ENU metres."""
        return self.box_min_m + position_unit * self.lengths_m

    def contains(self, position_m: Float[np.ndarray, "3"], tolerance_m: float = 1e-6) -> bool:
        """Whether a point lies in the box."""
        point = np.asarray(position_m)
        return bool(((point >= self.box_min_m - tolerance_m) & (point <= self.box_max_m + tolerance_m)).all())
