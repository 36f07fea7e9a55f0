"""How the figures are printed and drawn."""

from __future__ import annotations

import pathlib
from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

mpl.use("Agg")

FIGURES = pathlib.Path(__file__).parent / "figures"
RESOLUTION_DPI = 70
PATHS_DRAWN = 6


def print_claims(figure: int, title: str, rows: Sequence[tuple[str, str, str]]) -> None:
    """One block of text: what the paper says, what is found, and whether that agrees."""
    print(f"\nSVES figure {figure}: {title}")
    for claim, found, verdict in rows:
        print(f"  paper  {claim}\n  here   {found}\n  so     {verdict}")


def save(figure: Figure, name: str) -> None:
    """Write a small picture, and say where."""
    FIGURES.mkdir(exist_ok=True)
    path = FIGURES / f"{name}.png"
    figure.savefig(path, dpi=RESOLUTION_DPI, bbox_inches="tight")
    print(f"  drawn  {path.relative_to(pathlib.Path.cwd()) if path.is_relative_to(pathlib.Path.cwd()) else path}")


def draw_square(axes: Axes, paths: np.ndarray, title: str, centers: np.ndarray, radii: np.ndarray) -> None:
    """Paths in the unit square, seen from above, with its obstacles."""
    for center, radius in zip(centers, radii, strict=True):
        axes.add_patch(mpl.patches.Circle(center[:2], radius, color="0.75"))
    for path in paths[:PATHS_DRAWN]:
        axes.plot(path[:, 0], path[:, 1], linewidth=1.0)
    axes.set(title=title, xlim=(-0.05, 1.05), ylim=(-0.05, 1.05), aspect="equal", xticks=[], yticks=[])
    axes.title.set_fontsize(9)
