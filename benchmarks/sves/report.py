"""How the figures are printed and drawn."""

from __future__ import annotations

import pathlib
from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks import claims

FIGURES = pathlib.Path(__file__).parent / "figures"
PATHS_DRAWN = 6
MOST_TIMES = 1000.0
"""How many times less is told of a metric; it can get as small as rounding."""


def print_claims(figure: int, title: str, rows: Sequence[tuple[str, str, str]]) -> None:
    """One block of text: what the paper says, what is found, and whether that agrees."""
    claims.print_claims(f"SVES figure {figure}: {title}", rows)


def times_less(recipe: float, product: float) -> str:
    """How much lower the product's E is than the recipe's."""
    times = recipe / product
    return f"more than {MOST_TIMES:.0f} times less" if times > MOST_TIMES else f"{times:.0f} times less"


def save(figure: Figure, name: str) -> None:
    """Write a small picture, and say where."""
    claims.save(figure, FIGURES / f"{name}.png")


def draw_square(axes: Axes, paths: np.ndarray, title: str, centers: np.ndarray, radii: np.ndarray) -> None:
    """Paths in the unit square, seen from above, with its obstacles."""
    for center, radius in zip(centers, radii, strict=True):
        axes.add_patch(mpl.patches.Circle(center[:2], radius, color="0.75"))
    for path in paths[:PATHS_DRAWN]:
        axes.plot(path[:, 0], path[:, 1], linewidth=1.0)
    axes.set(title=title, xlim=(-0.05, 1.05), ylim=(-0.05, 1.05), aspect="equal", xticks=[], yticks=[])
    axes.title.set_fontsize(9)
