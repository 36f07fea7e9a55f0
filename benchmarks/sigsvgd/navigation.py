"""Navigation of a point mass through a grid of pillars, in receding horizon.

As in the authors' public settings: 4 × 4 pillars of 0.6 m in a box of 4 m, 2 kg, dt 0.015 s, a horizon of 30, 300
steps, 30 policies with ten samples each, two Stein steps a control by Adam at 1, Σ = 5², collision 1e6; an episode is
over when place and speed together are within 1 of the target. Taken: no speed limit, no constant policies beside the
others, kernels of paths see every third place. MPPI has one policy and as many rollouts (300, twice a control). Twenty
episodes each.

python -m benchmarks.sigsvgd.navigation
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable

import jax
import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Array
from matplotlib.patches import Rectangle

from benchmarks.sigsvgd.point_mass import (
    CENTERS_M,
    EDGE_M,
    STEPS,
    TARGET,
    WIDTH_M,
    Episode,
    Flown,
    mppi_episode,
    stein_episode,
)
from benchmarks.sigsvgd.report import print_claims, print_table, save
from benchmarks.sigsvgd.transport import Contender

EPISODES = 20
SHOWN = (Contender.PRINTED, Contender.SIGNATURE, Contender.OWN, Contender.RBF, Contender.IDENTITY)
MPPI = "MPPI"


def main() -> None:
    """Print and draw."""
    controllers: dict[str, Callable[[Array], Flown]] = {
        **{one.value: functools.partial(stein_episode, one) for one in SHOWN},
        MPPI: mppi_episode,
    }
    flown: dict[str, list[Episode]] = {}
    rows, costs = [], {}
    for name, controller in controllers.items():
        fly = jax.jit(controller)
        jax.block_until_ready(fly(jax.random.key(0)))
        started_s = time.perf_counter()
        flown[name] = [Episode(*map(np.asarray, fly(jax.random.key(seed)))) for seed in range(EPISODES)]
        step_ms = 1e3 * (time.perf_counter() - started_s) / (EPISODES * STEPS)
        succeeded = [one for one in flown[name] if one.succeeded]
        collided = sum(one.collided_at < one.reached_at for one in flown[name])
        costs[name] = np.array([one.total_cost for one in succeeded])
        steps = np.array([one.steps for one in succeeded])
        rows.append(
            f"| {name} | {len(succeeded)}/{EPISODES} | {collided} "
            f"| {costs[name].mean():.0f} ± {costs[name].std():.0f} "
            f"| {steps.mean():.0f} ± {steps.std():.0f} | {step_ms:.1f} ms |"
        )
    print_table(
        f"navigation, {EPISODES} episodes; cost and steps of those that succeeded",
        "| controller | reached | collided | cost | steps | control step |",
        rows,
    )
    means = {name: float(np.mean(values)) for name, values in costs.items()}
    print_claims(
        [
            (
                "lower average costs than competing alternatives (abstract)",
                "; ".join(f"{name} {value:.0f}" for name, value in means.items()),
                f"lowest: {min(means, key=lambda name: means[name])}",
            )
        ]
    )
    draw(flown)


def draw(flown: dict[str, list[Episode]]) -> None:
    """Every controller's episodes."""
    figure, axes = plt.subplots(1, len(flown), figsize=(2.3 * len(flown), 2.6))
    half = 0.5 * EDGE_M
    for axis, (name, episodes) in zip(axes, flown.items(), strict=True):
        for x in CENTERS_M:
            for y in CENTERS_M:
                axis.add_patch(Rectangle((x - 0.5 * WIDTH_M, y - 0.5 * WIDTH_M), WIDTH_M, WIDTH_M, color="0.8"))
        for one in episodes:
            axis.plot(*one.states[: one.steps, :2].T, linewidth=0.6)
        axis.plot(*TARGET[:2], "k*", markersize=5)
        axis.set(title=name, xlim=(-half, half), ylim=(-half, half), aspect="equal", xticks=[], yticks=[])
        axis.title.set_fontsize(8)
    save(figure, "navigation")


if __name__ == "__main__":
    main()
