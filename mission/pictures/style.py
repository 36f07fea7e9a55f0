"""Colours, sizes and words that the pictures share."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

from matplotlib import font_manager
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.textpath import TextToPath

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

INK, SOFT, FAINT = "#1f2933", "#7b8794", "#cbd2d9"
PATH, LIMIT, LINE, GOOD, GROUND = "#d9480f", "#c92a2a", "#1c4e80", "#2b8a3e", "#a0703c"
TALL, LOW = "#52606d", "#b6bec8"
INFORMATION = LinearSegmentedColormap.from_list("information", ["#ffffff", "#d3e6f0", "#8fbdd6", "#4a8fb5", "#236a93"])
HEIGHTS = LinearSegmentedColormap.from_list("heights", ["#5f0f40", "#c1121f", "#f48c06", "#ffdd4a"])
"""From the lowest to the highest place of a path."""

WIDTH_IN, MAP_IN, HEADING_IN = 13.0, 7.1, 1.05
MAP_LEFT, SERIES_LEFT, SERIES_RIGHT = 0.062, 0.655, 0.915
"""Of the width: beyond the right end stand the names of the limits, where they hide nothing."""
STYLE: dict[RcKeyType, Any] = {
    "font.size": 9.0,
    "text.parse_math": False,
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "text.color": INK,
    "legend.frameon": False,
}
POINTS_PER_IN = 72.0


def duration(seconds: float) -> str:
    """A time as people say it."""
    whole = round(seconds)
    return f"{whole // 60} min {whole % 60} s" if seconds >= 120.0 else f"{seconds:.1f} s"


def distance(metres: float) -> str:
    """A way as people say it."""
    return f"{metres / 1000.0:.2f} km" if metres >= 1000.0 else f"{metres:.1f} m"


def plain(text: str) -> str:
    """A text with a question mark for every sign that the font does not have, which would be drawn as a box."""
    known = _signs()
    return "".join(sign if ord(sign) in known else "?" for sign in text)


def fitted(text: str, width_in: float, size: float, weight: str = "normal") -> str:
    """A text that can be drawn (`plain`), and cut so that it is no wider than there is room for."""
    font = font_manager.FontProperties(size=size, weight=weight)

    def width_of(words: str) -> float:
        return TextToPath().get_text_width_height_descent(words, font, ismath=False)[0] / POINTS_PER_IN

    text = plain(text)
    if width_of(text) <= width_in:
        return text
    while text and width_of(text + "…") > width_in:
        text = text[:-1]
    return text.rstrip() + "…"


@functools.cache
def _signs() -> frozenset[int]:
    return frozenset(font_manager.get_font(font_manager.findfont("DejaVu Sans")).get_charmap())
