"""How large a pattern may be drawn: sizes are whole (rows, turns, stops), and only drawing one shows its length."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

Way = Float[np.ndarray, "point 3"]
Ways = Callable[[float], Way]
"""From a reach to what is drawn within it."""

WELL_FITTED = 0.95
"""A size is good enough whose length is this share of what may be."""
_AIM = 0.5 * (WELL_FITTED + 1.0)
_GROWTH = 4


def fitted(make: Callable[[int], Way], length_m: Callable[[Way], float], most: int) -> Ways:
    """The pattern of about the largest size within a reach; of size one where even that is too long.

    Each size is drawn once, however many reaches are asked for.

    Args:
        make: Draws a size, 1 … most; larger ones are longer, all in all.
        length_m: Length of what is drawn.
        most: The largest size.
    """
    ways: dict[int, Way] = {}
    lengths: dict[int, float] = {}

    def within(reach_m: float) -> Way:
        while True:
            high = min((size for size, length in lengths.items() if length > reach_m), default=most + 1)
            low = max((size for size in lengths if size < high), default=0)
            if high - low <= 1 or lengths.get(low, 0.0) >= WELL_FITTED * reach_m:
                return ways[max(low, 1)]
            size = _between(low, high, _AIM * reach_m, lengths)
            ways[size] = make(size)
            lengths[size] = length_m(ways[size])

    return within


def _between(low: int, high: int, aim_m: float, lengths: dict[int, float]) -> int:
    """The size to draw next, larger than one and smaller than another, as if length were a power of it.

    Args:
        low: Drawn and too short; zero: none is.
        high: Drawn and too long; or one more than the largest size.
        aim_m: Wanted length.
        lengths: Of the sizes that were drawn.
    """
    if low == 0:
        return 1
    # Beyond the largest that was drawn, go by the one before; not far, since a power is only a guess.
    other = high if high in lengths else max((size for size in lengths if size < low), default=0)
    growth = math.log(_GROWTH)
    if other and 0.0 < lengths[low] != lengths[other] > 0.0:
        power = math.log(other / low) / math.log(lengths[other] / lengths[low])
        growth = min(growth, power * math.log(aim_m / lengths[low])) if power > 0.0 else growth
    return min(max(int(low * math.exp(growth)), low + 1), high - 1)
