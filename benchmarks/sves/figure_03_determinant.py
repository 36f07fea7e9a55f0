"""Diversity over the steps: det K of the Stein set against independent descent.

Taken: the problem of figure 2, det K with the fixed bandwidth of `planner.diversity` and with others, medians over four
start sets.

python -m benchmarks.sves.figure_03_determinant
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.sves.product import square
from benchmarks.sves.recipe import Recipe, run, start_set, world
from benchmarks.sves.report import print_claims, save
from planner.diversity import Diversity, diversity, eigenvalues, rms_distances
from planner.information import uniform
from planner.problem import Kernel, MetricWeights
from planner.spectral_metric import SpectralMetric

MODES = (8, 8, 1)
SEEDS, STEPS = 4, 4000
KEPT = 20
BANDWIDTHS_UNIT2 = (0.2, 0.1, 0.07, 0.05, 0.03, 0.02, 0.01)
RECIPES = {
    "RBF": Recipe(steps=STEPS),
    "Markov RBF": Recipe(kernel=Kernel.MARKOV, steps=STEPS),
    "independent": Recipe(kernel=Kernel.IDENTITY, steps=STEPS),
}


def determinants(paths_unit: np.ndarray) -> list[float]:
    """Det K of a set for each of the bandwidths."""
    distances = rms_distances(paths_unit.astype(float))
    return [float(eigenvalues(distances, bandwidth).prod()) for bandwidth in BANDWIDTHS_UNIT2]


def most_determinant(count: int, bandwidth_unit2: float) -> float:
    """A bound on det K of paths that each spend the same time everywhere in the unit square.

    About the middle each has a mean square of 1/6, so pairs have 2/6 · N/(N − 1) in the mean at the most; exp(−d²/h) is
    convex, and of all K with a given mean beside the diagonal the one whose entries are alike has the largest
    determinant.
    """
    alike = np.exp(-(count / (count - 1)) / (3.0 * bandwidth_unit2))
    return float((1.0 - alike) ** (count - 1) * (1.0 + (count - 1) * alike))


def main() -> None:
    """Print and draw."""
    information = uniform(square(), (64, 64, 1))
    metric = SpectralMetric.of(information.coefficients(MODES), MetricWeights.LINEAR)
    place = world(metric, (0.1, 0.1), (0.9, 0.9), 100)
    steps: dict[str, np.ndarray] = {}
    measured: dict[str, list[list[Diversity]]] = {}
    by_bandwidth: dict[str, np.ndarray] = {}
    energy: dict[str, np.ndarray] = {}
    for name, recipe in RECIPES.items():
        runs = [run(recipe, place, start_set(place, 20, seed)) for seed in range(SEEDS)]
        shown = np.unique(np.geomspace(1, len(runs[0].step), KEPT).astype(int)) - 1
        steps[name] = runs[0].step[shown]
        measured[name] = [[diversity(kept) for kept in one.particles[shown]] for one in runs]
        by_bandwidth[name] = np.median([determinants(one.last) for one in runs], axis=0)
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
                if min(last["RBF"], last["Markov RBF"]) > 0.99 and last["independent"] < 0.01
                else f"it rises towards 1 and is not there after {STEPS} steps; independent descent "
                + ("stays at 0" if last["independent"] < 0.01 else "does not stay at 0"),
            ),
            (
                "(det K at the end, by the bandwidth of K)",
                "; ".join(
                    f"h {bandwidth:g}: " + ", ".join(f"{by_bandwidth[name][place]:.2g}" for name in RECIPES)
                    for place, bandwidth in enumerate(BANDWIDTHS_UNIT2)
                ),
                f"in this order: {', '.join(RECIPES)}; with 0.1 no twenty paths that cover the square evenly exceed "
                f"{most_determinant(20, 0.1):.2f}",
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
