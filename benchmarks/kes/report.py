"""Where the figures go."""

from __future__ import annotations

import pathlib

from matplotlib.figure import Figure

from benchmarks import claims

FIGURES = pathlib.Path(__file__).parent / "figures"


def save(figure: Figure, name: str) -> None:
    """Write a small picture, and say where."""
    claims.save(figure, FIGURES / f"{name}.png")
