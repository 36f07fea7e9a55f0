"""Kernels compared on one problem.

Taken: the problem of figure 2, 500 steps, medians over four start sets. The constant kernel takes a twentieth of ε: the
sum over all scores is N times that of a kernel that is one for its own candidate only, and diverges with the paper's.

python -m benchmarks.sves.figure_09_kernels
"""

from __future__ import annotations

import time

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.sves.product import planned, square
from benchmarks.sves.recipe import Recipe, Run, run, start_set, world
from benchmarks.sves.report import draw_square, print_claims, save
from planner.diversity import diversity
from planner.information import uniform
from planner.problem import Kernel, MetricWeights, Options
from planner.spectral_metric import SpectralMetric

MODES = (8, 8, 1)
SEEDS, STEPS = 4, 500
LENGTH = 6.5


def main() -> None:
    """Print and draw."""
    information = uniform(square(), (64, 64, 1))
    metric = SpectralMetric.of(information.coefficients(MODES), MetricWeights.LINEAR)
    place = world(metric, (0.1, 0.1), (0.9, 0.9), 100)
    runs: dict[Kernel, list[Run]] = {}
    rows = {}
    for kernel in Kernel:
        recipe = Recipe(kernel=kernel, steps=STEPS, step_size=0.025 if kernel is Kernel.CONSTANT else 0.5)
        started = time.perf_counter()
        runs[kernel] = [run(recipe, place, start_set(place, 20, seed)) for seed in range(SEEDS)]
        seconds = (time.perf_counter() - started) / SEEDS
        sound = [one for one in runs[kernel] if np.isfinite(one.last).all()]
        spread = [diversity(one.last) for one in sound]
        rows[kernel] = (
            np.median([one.metric[-1].min() for one in sound]),
            np.median([np.median(one.metric[-1]) for one in sound]),
            np.median([one.determinant for one in spread]),
            np.median([one.effective_plans for one in spread]),
            seconds,
            SEEDS - len(sound),
        )
    table = [
        f"{'kernel':<16} {'best E':>8} {'median E':>9} {'det K':>8} {'distinct of 20':>15} {'s':>6} {'diverged':>9}"
    ]
    table += [
        f"{kernel.value:<16} {row[0]:>8.4f} {row[1]:>9.4f} {row[2]:>8.2g} {row[3]:>15.1f} {row[4]:>6.1f} {row[5]:>9d}"
        for kernel, row in rows.items()
    ]
    polished = {}
    for kernel in (Kernel.RBF, Kernel.MARKOV, Kernel.SIGNATURE, Kernel.IDENTITY):
        plan, _ = planned(
            information, np.array([0.1, 0.1, 0.5]), np.array([0.9, 0.9, 0.5]), LENGTH, Options(12, MODES, kernel=kernel)
        )
        polished[kernel] = plan
    table += [
        f"product, {kernel.value}: best E {plan.best.ergodic_metric:.6f}, median "
        f"{np.median([one.ergodic_metric for one in plan.candidates]):.5f}, "
        f"{plan.diversity.effective_plans:.1f} distinct of 12"
        for kernel, plan in polished.items()
    ]
    markov, rbf, constant, identity = (
        rows[kernel] for kernel in (Kernel.MARKOV, Kernel.RBF, Kernel.CONSTANT, Kernel.IDENTITY)
    )
    print_claims(
        9,
        "kernels",
        [
            (
                "the Markov RBF (eq. 23) as the kernel for paths, beside RBF",
                "\n         ".join(table),
                f"det K {markov[2]:.2f} against {rbf[2]:.2f}: {'more' if markov[2] >= rbf[2] else 'less'} diverse; "
                f"best E {markov[0]:.4f} against {rbf[0]:.4f}: "
                f"{'no worse' if markov[0] <= rbf[0] else 'paid for with coverage'}",
            ),
            (
                "vanilla parallel optimisation is k ≡ 1",
                f"median E {constant[1]:.3f} against {identity[1]:.4f} with the identity",
                "refuted: k ≡ 1 gives all paths the mean score; independent descent is the identity kernel",
            ),
        ],
    )
    figure, axes = plt.subplots(1, len(Kernel), figsize=(2.4 * len(Kernel), 2.7))
    for axis, kernel in zip(axes, Kernel, strict=True):
        draw_square(axis, runs[kernel][0].last, kernel.value, np.zeros((0, 3)), np.zeros(0))
    save(figure, "figure_09_kernels")


if __name__ == "__main__":
    main()
