"""Coverage of a cube.

Taken: K = 8³, T = 150, N = 4, uniform information; E in both conventions of Λ.

python -m benchmarks.sves.figure_05_cube
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.sves.product import EDGE_M, planned, square
from benchmarks.sves.recipe import Recipe, length, run, start_set, world
from benchmarks.sves.report import PATHS_DRAWN, print_claims, save
from planner.diversity import diversity
from planner.information import uniform
from planner.problem import MetricWeights, Options
from planner.spectral_metric import SpectralMetric, mean_basis, mode_weights

MODES = (8, 8, 8)
START, END = (0.1, 0.1, 0.1), (0.9, 0.9, 0.9)


def squared_metric(path: np.ndarray, target: np.ndarray) -> float:
    """E with Mathew & Mezić's weights."""
    mean = mean_basis(path, np.full(len(path), 1.0 / len(path)), MODES)
    return float(np.sum(mode_weights(MODES, MetricWeights.SQUARED) * (mean - target) ** 2))


def main() -> None:
    """Print and draw."""
    information = uniform(square(EDGE_M, EDGE_M), (32, 32, 32))
    target = information.coefficients(MODES)
    place = world(SpectralMetric.of(target, MetricWeights.LINEAR), START, END, 150)
    sves = run(Recipe(steps=2000), place, start_set(place, 4, seed=0))
    best = int(np.argmin(sves.metric[-1]))
    longest = float(length(sves.last)[best])
    plan, paths = planned(information, np.array(START), np.array(END), longest, Options(4, MODES))
    chosen = paths[plan.selected]
    print_claims(
        5,
        "a cube",
        [
            (
                "multiple strategies in three dimensions",
                f"best E(lin) {sves.metric[-1].min():.4f}, E(sq) {squared_metric(sves.last[best], target):.4f} "
                f"at length {longest:.1f}; {diversity(sves.last).effective_plans:.1f} distinct of 4; "
                f"{np.mean((sves.last < 0.0) | (sves.last > 1.0)):.0%} of the coordinates outside",
                "holds",
            ),
            (
                "(the product's solver, at most as long)",
                f"best E(lin) {plan.best.ergodic_metric:.4f}, E(sq) {squared_metric(chosen, target):.4f} at length "
                f"{length(chosen):.1f}, lawnmower {plan.lawnmower_ergodic_metric:.4f}; "
                f"{plan.diversity.effective_plans:.1f} distinct of 4, all inside",
                f"{plan.best.ergodic_metric / sves.metric[-1].min():.2f} of the recipe's E, and proven",
            ),
        ],
    )
    figure = plt.figure(figsize=(8, 3.6))
    for index, (title, shown) in enumerate((("paper's recipe", sves.last), ("product", paths)), start=1):
        axes = figure.add_subplot(1, 2, index, projection="3d")
        for path in shown[:PATHS_DRAWN]:
            axes.plot(*path.T, linewidth=0.8)
        axes.set_title(title, fontsize=9)
        axes.tick_params(labelsize=6)
    save(figure, "figure_05_cube")


if __name__ == "__main__":
    main()
