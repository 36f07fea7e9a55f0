"""How a paper's claim is printed beside what is found here, and what is drawn is saved."""

from __future__ import annotations

import pathlib
from collections.abc import Sequence

import matplotlib as mpl
from matplotlib.figure import Figure

mpl.use("Agg")

RESOLUTION_DPI = 70


def print_claims(heading: str, rows: Sequence[tuple[str, str, str]]) -> None:
    """One block of text: what the paper says, what is found, and whether that agrees."""
    print(f"\n{heading}")
    for claim, found, verdict in rows:
        print(f"  paper  {claim}\n  here   {found}\n  so     {verdict}")


def save(figure: Figure, path: pathlib.Path) -> None:
    """Write a small picture, and say where."""
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path, dpi=RESOLUTION_DPI, bbox_inches="tight")
    print(f"  drawn  {path.relative_to(pathlib.Path.cwd()) if path.is_relative_to(pathlib.Path.cwd()) else path}")
