"""Diversity over the steps: det K of the Stein set against independent descent.

Taken: the problem of figure 2, det K with the fixed bandwidth of `planner.diversity`, medians over four start sets.

python -m benchmarks.sves.figure_03_determinant
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.sves.product import square
from benchmarks.sves.recipe import Recipe, run, start_set, world
from benchmarks.sves.report import print_claims, save
from planner.diversity import Diversity, diversity
from planner.information import uniform
from planner.problem import Kernel, MetricWeights
from planner.spectral_metric import SpectralMetric

MODES = (8, 8, 1)
SEEDS, STEPS = 4, 4000
KEPT = 20
RECIPES = {
    "RBF": Recipe(steps=STEPS),
    "Markov RBF": Recipe(kernel=Kernel.MARKOV, steps=STEPS),
    "independent": Recipe(kernel=Kernel.IDENTITY, steps=STEPS),
}


def main() -> None:
    """Print and draw."""
    information = uniform(square(), (64, 64, 1))
    metric = SpectralMetric.of(information.coefficients(MODES), MetricWeights.LINEAR)
    place = world(metric, (0.1, 0.1), (0.9, 0.9), 100)
    steps: dict[str, np.ndarray] = {}
    measured: dict[str, list[list[Diversity]]] = {}
    energy: dict[str, np.ndarray] = {}
    for name, recipe in RECIPES.items():
        runs = [run(recipe, place, start_set(place, 20, seed)) for seed in range(SEEDS)]
        shown = np.unique(np.geomspace(1, len(runs[0].step), KEPT).astype(int)) - 1
        steps[name] = runs[0].step[shown]
        measured[name] = [[diversity(kept) for kept in one.particles[shown]] for one in runs]
        energy[name] = np.median([one.metric[shown].min(axis=1) for one in runs], axis=0)

    def over_steps(name: str, attribute: str) -> np.ndarray:
        return np.median([[getattr(kept, attribute) for kept in one] for one in measured[name]], axis=0)

    last = {name: over_steps(name, "determinant")[-1] for name in RECIPES}
    print_claims(
        3,
        "diversity over the steps",
        [
            (
                "det K of the Stein set rises to 1, that of independent descent stays at 0",
                "; ".join(f"{name} {value:.3g}" for name, value in last.items()),
                "holds"
                if min(last["RBF"], last["Markov RBF"]) > 0.95 and last["independent"] < 0.01
                else f"it rises towards 1 and is not there after {STEPS} steps; independent descent "
                + ("stays at 0" if last["independent"] < 0.01 else "does not stay at 0"),
            ),
            (
                "(what it costs: best E of the set)",
                "; ".join(f"{name} {values[-1]:.4f}" for name, values in energy.items()),
                "repulsion that does not fade keeps paths from their optimum",
            ),
        ],
    )
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.0))
    for name in RECIPES:
        axes[0].plot(steps[name], over_steps(name, "determinant"), label=name)
        axes[1].plot(steps[name], over_steps(name, "effective_plans"), label=name)
        axes[2].semilogy(steps[name], energy[name], label=name)
    axes[0].set(title="det K", xlabel="step", ylim=(-0.02, 1.02))
    axes[1].set(title="distinct plans of 20", xlabel="step")
    axes[2].set(title="best E", xlabel="step")
    axes[0].legend(fontsize=8)
    save(figure, "figure_03_determinant")


if __name__ == "__main__":
    main()
