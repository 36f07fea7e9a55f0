"""A set of paths through a forest.

Taken: twelve circles, N = 20, T = 100, K = 8²; the paper's penalty as printed and with its sign as it must be.

python -m benchmarks.sves.figure_04_forest
"""

from __future__ import annotations

import dataclasses

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.sves.product import planned, square
from benchmarks.sves.recipe import ObstacleTerm, Recipe, World, deepest, length, run, start_set, world
from benchmarks.sves.report import draw_square, print_claims, save, times_less
from planner.information import uniform
from planner.problem import MetricWeights, Options
from planner.spectral_metric import SpectralMetric

MODES = (8, 8, 1)
START, END = (0.05, 0.05), (0.95, 0.95)


def forest(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Twelve circles that touch neither each other nor the ends."""
    generator = np.random.default_rng(seed)
    centers, radii = [np.array(START), np.array(END)], [0.03, 0.03]
    while len(centers) < 14:
        center, radius = generator.uniform(0.08, 0.92, 2), generator.uniform(0.03, 0.08)
        if all(np.linalg.norm(center - c) > radius + r + 0.05 for c, r in zip(centers, radii, strict=True)):
            centers.append(center)
            radii.append(radius)
    return np.array(centers[2:]), np.array(radii[2:])


def inside(place: World, paths: np.ndarray) -> float:
    """Share of all waypoints that lie in a circle."""
    distance = np.linalg.norm(paths[:, :, None] - place.centers, axis=-1)
    return float((distance < place.radii).any(axis=-1).mean())


def from_the_middle(place: World, paths: np.ndarray) -> float:
    """Mean distance of the waypoints from the mean of the circles' centres."""
    return float(np.linalg.norm(paths - place.centers.mean(axis=0), axis=-1).mean())


def main() -> None:
    """Print and draw."""
    centers, radii = forest(0)
    free = uniform(square(), (100, 100, 1)).where(
        lambda p: (np.linalg.norm(p[:, None, :2] / 100.0 - centers, axis=-1) > radii).all(axis=-1)
    )
    metric = SpectralMetric.of(free.coefficients(MODES), MetricWeights.LINEAR)
    place = world(metric, START, END, 100, centers, radii)
    start = start_set(place, 20, seed=0)
    corrected = run(Recipe(steps=1000), place, start)
    printed = run(dataclasses.replace(Recipe(steps=1000), obstacle_term=ObstacleTerm.PRINTED), place, start)
    longest = float(np.median(length(corrected.last)))
    plan, paths = planned(
        free, np.append(START, 0.5), np.append(END, 0.5), longest, Options(12, MODES), place.centers, place.radii
    )
    proven = sum(candidate.feasible for candidate in plan.candidates)
    touching = sum(deepest(place, path[None]) > 0.0 for path in corrected.last)
    print_claims(
        4,
        "a forest",
        [
            (
                "penalty max(0, ‖x − c‖ − r)",
                f"waypoints end {from_the_middle(place, printed.last):.2f} from the middle of the trees (start set "
                f"{from_the_middle(place, start):.2f}), best E {printed.metric[-1].min():.3f}",
                "attracts: as printed it draws every path into the trees",
            ),
            (
                "feasible coverage trajectories in cluttered space",
                f"with the sign corrected {inside(place, corrected.last):.1%} inside; {touching} of 20 paths touch a "
                f"circle, the deepest by {max(0.0, deepest(place, corrected.last)):.3f}; best E "
                f"{corrected.metric[-1].min():.4f}, length {longest:.2f}",
                "soft penalties alone do not keep clear" if touching else "holds",
            ),
            (
                "(the product's solver, at most as long)",
                f"{proven} of 12 proven clear in continuous time; best E {plan.best.ergodic_metric:.5f}, lawnmower "
                f"around the trees {plan.lawnmower_ergodic_metric:.4f}; {plan.diversity.effective_plans:.1f} distinct",
                times_less(corrected.metric[-1].min(), plan.best.ergodic_metric),
            ),
        ],
    )
    figure, axes = plt.subplots(1, 3, figsize=(10, 3.4))
    draw_square(axes[0], printed.last, "penalty as printed", centers, radii)
    draw_square(axes[1], corrected.last, "sign corrected", centers, radii)
    draw_square(axes[2], paths, "product, proven", centers, radii)
    save(figure, "figure_04_forest")


if __name__ == "__main__":
    main()
