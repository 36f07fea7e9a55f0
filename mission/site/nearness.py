"""Whether a file of obstacles lies where the mission is: one that lies elsewhere keeps nobody from anything."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

FAR_M = 2_000.0
"""Nothing of a file nearer to the box than this: it was meant for another place."""


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
    gaps = [
        float(
            np.maximum(
                np.min(part, axis=0) - high_m[: part.shape[1]], low_m[: part.shape[1]] - np.max(part, axis=0)
            ).max()
        )
        for part in parts_m
    ]
    if (nearest := min(gaps)) > FAR_M:
        raise ValueError(f"{name} lies {nearest / 1000.0:.0f} km from the mission: {hint}")
