"""Receding horizon under the kernel metric: the flight of SVES's figure 6, whose information moves after half of it.

Taken: the multirotor, its tree and its two places of `benchmarks.sves.figure_06_adaptation`, N = 12, medians over
seeds; the kernel's width is that of the first information, the memory that of `ControlMetric`.

python -m benchmarks.kes.control
"""

from __future__ import annotations

import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

from benchmarks.claims import print_claims
from benchmarks.kes.report import save
from benchmarks.sves.figure_06_adaptation import (
    BOX,
    HORIZON,
    MODES,
    NEW,
    OLD,
    STAYS,
    STEPS,
    TREE,
    TREE_RADIUS_M,
    near,
    places,
    spectral,
    task_for,
)
from benchmarks.sves.flights import Flight, ergodic_metric, fly
from planner.information import DensityGrid
from planner.kernel_metric import KernelMetric, kernel_metric

SEEDS, CANDIDATES = 12, 12
FLAT = (True, True, False)
START = [10.0, 10.0, 10.0, 0.0, 0.0, 0.0, 0.0]


def kernel_e(metric: KernelMetric, positions_m: np.ndarray) -> float:
    """E of equally long moments under a kernel metric."""
    unit = jnp.asarray(BOX.unit_from_enu(positions_m), jnp.float32)
    return float(metric(unit, jnp.full(len(unit), 1.0 / len(unit))))


def main() -> None:
    """Print and draw."""
    before, after = places(OLD, STAYS), places(NEW, STAYS)
    width = np.asarray(kernel_metric(before, counts=FLAT).variance)

    def by_kernel(information: DensityGrid) -> KernelMetric:
        return kernel_metric(information, counts=FLAT, variance_unit2=width)

    found: dict[str, list[Flight]] = {}
    for name, metric_of in (("spectral", spectral), ("kernel", by_kernel)):
        tasks = [task_for(metric_of(information)) for information in (before, after)]
        found[name] = [
            fly(lambda index, tasks=tasks: tasks[index >= STEPS // 2], START, STEPS, CANDIDATES, HORIZON, seed)
            for seed in range(SEEDS)
        ]

    e_after = {
        name: np.median([ergodic_metric(flight.positions_m[STEPS // 2 :], after, MODES, BOX) for flight in flights])
        for name, flights in found.items()
    }
    both = {
        name: sum(all(near(flight, place, 1) > 0.1 for place in (NEW, STAYS)) for flight in flights)
        for name, flights in found.items()
    }

    def line(name: str) -> str:
        flights = found[name]
        shares = [np.median([near(flight, place, 1) for flight in flights]) for place in (NEW, STAYS)]
        e_kernel = np.median([kernel_e(by_kernel(after), flight.positions_m[STEPS // 2 :]) for flight in flights])
        clear = min(np.linalg.norm(flight.positions_m[:, :2] - TREE, axis=1).min() for flight in flights)
        return (
            f"under {name}: after the move {shares[0]:.0%} of the time near the new place, {shares[1]:.0%} near the "
            f"one that stays, over a tenth at each in {both[name]} of {SEEDS} flights; E of that half "
            f"{e_after[name]:.3f} (spectral), {e_kernel:.2f} (kernel); least distance to the trunk "
            f"{clear - TREE_RADIUS_M:.1f} m"
        )

    print_claims(
        "KES: receding horizon",
        [
            (
                "optimal control under the kernel metric (there by iLQR, here by SVES Alg. 2)",
                "\n         ".join(line(name) for name in found),
                f"{'holds' if e_after['kernel'] < 1.2 * e_after['spectral'] else 'does not hold'}: the spectral E of "
                f"kernel flights is {e_after['kernel'] / e_after['spectral']:.2f} times that of spectral ones",
            )
        ],
    )
    figure, plots = plt.subplots(1, 2, figsize=(7.0, 3.4))
    for plot, (name, flights) in zip(plots, found.items(), strict=True):
        plot.imshow(after.mass[:, :, 0].T, origin="lower", extent=(0.0, 100.0, 0.0, 100.0), cmap="Blues")
        plot.add_patch(plt.Circle(TREE, TREE_RADIUS_M, color="0.6"))
        plot.plot(*flights[0].positions_m[STEPS // 2 :, :2].T, color="tab:red", linewidth=1.0)
        plot.set(title=f"{name}, after the information moved", xticks=[], yticks=[])
        plot.title.set_fontsize(9)
    save(figure, "control")


if __name__ == "__main__":
    main()
