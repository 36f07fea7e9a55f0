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


def fitted(make: Callable[[int], Way], length_m: Callable[[Way], float], most: int, begin: int) -> Ways:
    """The pattern of about the largest size within a reach; of size one where even that is too long.

    Each size is drawn once, however many reaches are asked for.

    Args:
        make: Draws a size, 1 … most; larger ones are longer, all in all.
        length_m: Length of what is drawn.
        most: The largest size.
        begin: The size to draw first: of a pattern of the kind about what fits is known.
    """
    ways: dict[int, Way] = {}
    lengths: dict[int, float] = {}

    def within(reach_m: float) -> Way:
        while True:
            high = min((size for size, length in lengths.items() if length > reach_m), default=most + 1)
            low = max((size for size in lengths if size < high), default=0)
            if high - low <= 1 or lengths.get(low, 0.0) >= WELL_FITTED * reach_m:
                return ways[max(low, 1)]
            size = _between(low, high, _AIM * reach_m, lengths) if lengths else min(begin, most)
            ways[size] = make(size)
            lengths[size] = length_m(ways[size])

    return within


def _between(low: int, high: int, aim_m: float, lengths: dict[int, float]) -> int:
    """The size to draw next, larger than one and smaller than another, as if length were a power of it.

    Args:
        low: Drawn and too short; zero: none is, and then `high` is drawn.
        high: Drawn and too long; or one more than the largest size.
        aim_m: Wanted length.
        lengths: Of the sizes that were drawn.
    """
    here = low or high
    # Between two go by both: the nearest alone may creep. Beyond them go by the nearest.
    between = low > 0 and high in lengths
    other = high if between else min(lengths.keys() - {here}, key=lambda size: abs(size - here), default=here)
    power = 1.0
    if 0.0 < lengths[here] != lengths[other] > 0.0:
        power = abs(math.log(other / here) / math.log(lengths[other] / lengths[here]))
    growth = power * math.log(aim_m / lengths[here]) if lengths[here] > 0.0 else math.inf
    # Not far from what was drawn: a power is only a guess.
    farthest = math.log(_GROWTH)
    return min(max(int(here * math.exp(min(max(growth, -farthest), farthest))), low + 1), high - 1)
