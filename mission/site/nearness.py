"""Whether obstacles lie where the mission is: those that lie elsewhere keep nobody from anything."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

FAR_M = 2_000.0
"""What has nothing nearer to the box than this was meant for another place."""


def gap_m(
    part_m: Float[np.ndarray, "point axis"], low_m: tuple[float, float, float], high_m: tuple[float, float, float]
) -> float:
    """How far the box around some points is from a region, along the axis where that is most; negative: they overlap.

    Args:
        part_m: The points, along east and north (and up).
        low_m: Lower corner of the region.
        high_m: Upper corner.
    """
    axes = part_m.shape[1]
    return float(np.maximum(np.min(part_m, axis=0) - high_m[:axes], low_m[:axes] - np.max(part_m, axis=0)).max())


def demand_near(
    name: str,
    parts_m: Iterable[Float[np.ndarray, "point axis"]],
    low_m: tuple[float, float, float],
    high_m: tuple[float, float, float],
    hint: str,
) -> None:
    """Refuse what lies wholly elsewhere.

    Args:
        name: Of the file.
        parts_m: Points of each of its parts, along east and north (and up): how far a part reaches is what counts.
        low_m: Lower corner of the region of the mission.
        high_m: Upper corner.
        hint: What is probably the matter, as a question.

    Raises:
        ValueError: All of it is farther away than `FAR_M`.
    """
    gaps = [gap_m(part, low_m, high_m) for part in parts_m]
    if (nearest := min(gaps)) > FAR_M:
        raise ValueError(f"{name} lies {nearest / 1000.0:.0f} km from the mission: {hint}")
