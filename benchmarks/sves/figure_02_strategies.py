"""Several coverage strategies between the same two points of a uniform square.

Taken: N = 20, T = 100, K = 8², λ = 10, ε = 0.5, 500 steps, start set N(interpolation, 0.01).

python -m benchmarks.sves.figure_02_strategies
"""

from __future__ import annotations

import dataclasses

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.sves.product import planned, square
from benchmarks.sves.recipe import PRINTED, Recipe, length, run, start_set, world
from benchmarks.sves.report import draw_square, print_claims, save, times_less
from planner.diversity import diversity
from planner.information import uniform
from planner.problem import MetricWeights, Options
from planner.spectral_metric import SpectralMetric

MODES = (8, 8, 1)
START, END = (0.1, 0.1), (0.9, 0.9)
STABLE_STEP = 0.002


def main() -> None:
    """Print and draw."""
    information = uniform(square(), (64, 64, 1))
    place = world(SpectralMetric.of(information.coefficients(MODES), MetricWeights.LINEAR), START, END, 100)
    start = start_set(place, 20, seed=0)
    printed = run(PRINTED, place, start)
    slow = run(dataclasses.replace(PRINTED, step_size=STABLE_STEP, steps=2000), place, start)
    corrected = run(Recipe(), place, start)
    longest = float(np.median(length(corrected.last)))
    plan, paths = planned(
        information, np.array([0.1, 0.1, 0.5]), np.array([0.9, 0.9, 0.5]), longest, Options(12, MODES)
    )

    lost = int(np.argmax(~np.isfinite(printed.metric).all(axis=1)))
    spread = diversity(corrected.last)
    print_claims(
        2,
        "several coverage strategies",
        [
            (
                "the recipe: 15·Σ‖Δx‖², prior N(interpolation, 0.01) in the gradient, λ = 10, ε = 0.5",
                f"not a number within {printed.step[lost]} steps; with ε = {STABLE_STEP} every path stays the straight "
                f"line: best E {slow.metric[-1].min():.3f}, length {np.median(length(slow.last)):.2f}",
                "fails as printed",
            ),
            (
                "multiple coverage strategies are found in parallel (abstract)",
                f"with time averages, and the prior for the start set only: best E {corrected.metric[-1].min():.4f}, "
                f"median {np.median(corrected.metric[-1]):.4f}, length {longest:.2f}, "
                f"{spread.effective_plans:.1f} distinct of 20",
                "holds once corrected",
            ),
            (
                "(the product's solver, at most as long)",
                f"best E {plan.best.ergodic_metric:.6f} at length {length(paths[plan.selected]):.2f}, lawnmower "
                f"{plan.lawnmower_ergodic_metric:.4f}, {plan.diversity.effective_plans:.1f} distinct of 12, all proven",
                times_less(corrected.metric[-1].min(), plan.best.ergodic_metric),
            ),
        ],
    )
    figure, axes = plt.subplots(1, 3, figsize=(10, 3.4))
    nothing = (np.zeros((0, 3)), np.zeros(0))
    draw_square(axes[0], slow.last, f"as printed (ε = {STABLE_STEP})", *nothing)
    draw_square(axes[1], corrected.last, "corrected", *nothing)
    draw_square(axes[2], paths, "product", *nothing)
    save(figure, "figure_02_strategies")


if __name__ == "__main__":
    main()
