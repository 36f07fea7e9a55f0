"""How the experiments are printed and drawn."""

from __future__ import annotations

import pathlib
from collections.abc import Sequence

import matplotlib as mpl
from matplotlib.figure import Figure

mpl.use("Agg")

FIGURES = pathlib.Path(__file__).parent / "figures"
RESOLUTION_DPI = 60


def print_table(title: str, header: str, rows: Sequence[str]) -> None:
    """A table as this project's README has them."""
    print(f"\nSigSVGD: {title}\n")
    print(header)
    print("|" + "---|" * (header.count("|") - 1))
    print("\n".join(rows), flush=True)


def print_claims(rows: Sequence[tuple[str, str, str]]) -> None:
    """What the paper says, what is found, and what follows."""
    for claim, found, verdict in rows:
        print(f"\n  paper  {claim}\n  here   {found}\n  so     {verdict}")


def save(figure: Figure, name: str) -> None:
    """Write a small picture, and say where."""
    FIGURES.mkdir(exist_ok=True)
    figure.savefig(FIGURES / f"{name}.png", dpi=RESOLUTION_DPI, bbox_inches="tight")
    print(f"  drawn  benchmarks/sigsvgd/figures/{name}.png")
