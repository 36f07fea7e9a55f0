"""Time of a step over the horizon and the dimension.

Taken: N = 20, K = 8 on each axis that counts, RBF.

python -m benchmarks.sves.figure_11_horizon
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.sves.report import print_claims, save
from benchmarks.sves.step_times import step_ms
from benchmarks.timing import machine
from planner.workspace import Workspace

HORIZONS = (25, 50, 100, 200, 400, 800)
DIMENSIONS = {1: (8, 1, 1), 2: (8, 8, 1), 3: (8, 8, 8)}


def main() -> None:
    """Print and draw."""
    box = Workspace(np.zeros(3), np.ones(3))
    times = {
        axes: [step_ms(box, 20, horizon, modes, repeats=7, together=5) for horizon in HORIZONS]
        for axes, modes in DIMENSIONS.items()
    }
    print(machine())
    rows = [
        f"v = {axes}: "
        + ", ".join(f"T = {horizon} {1e3 * time:.0f} µs" for horizon, time in zip(HORIZONS, row, strict=True))
        for axes, row in times.items()
    ]
    growth = times[3][-1] / times[3][2]
    print_claims(
        11,
        "time of a step over T and v",
        [
            (
                "scales with horizon and dimension (the basis has K^v functions)",
                "\n         ".join(rows),
                f"T = 800 takes {growth:.1f}× T = 100 in 3-D; v = 3 takes {times[3][2] / times[2][2]:.1f}× v = 2 at "
                "T = 100 with 8× the basis: the separable form pays matrix products, not cosines, for each function",
            )
        ],
    )
    figure, axis = plt.subplots(figsize=(4.2, 3.0))
    for axes, row in times.items():
        axis.loglog(HORIZONS, 1e3 * np.array(row), marker="o", label=f"v = {axes}")
    axis.set(xlabel="waypoints T", ylabel="µs a step", title="N = 20, K = 8")
    axis.set_xticks(HORIZONS, [str(horizon) for horizon in HORIZONS])
    axis.minorticks_off()
    axis.legend(fontsize=8)
    save(figure, "figure_11_horizon")


if __name__ == "__main__":
    main()
