"""Receding horizon: the information moves in flight, and the flight follows.

Taken: a multirotor in a flat box, two places of information of which one moves after half the flight; N = 12 and 20
(the paper gives both), medians over eight seeds; the paper's φ on controls against own scores with repulsion.

python -m benchmarks.sves.figure_06_adaptation
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.sves.flights import Flight, ergodic_metric, fly
from benchmarks.sves.report import print_claims, save
from planner.control import ControlMetric, ControlTask, Transport
from planner.dynamics import Multirotor
from planner.information import DensityGrid, gaussians
from planner.obstacles import Cylinder, ObstacleField
from planner.priors import GaussianPrior
from planner.problem import MetricWeights
from planner.spectral_metric import SpectralMetric
from planner.workspace import Workspace

BOX = Workspace(np.zeros(3), np.array([100.0, 100.0, 20.0]))
MODES = (8, 8, 1)
STEPS, PERIOD_S, HORIZON, SEEDS = 200, 0.5, 20, 8
TREE, TREE_RADIUS_M, KEEP_OUT_M = np.array([50.0, 50.0]), 12.0, 1.0
OLD, NEW, STAYS = (25.0, 25.0), (80.0, 30.0), (50.0, 80.0)


def places(*middles: tuple[float, float]) -> DensityGrid:
    """Equal peaks, the same at every altitude."""
    mean = np.array([[*middle, 10.0] for middle in middles])
    return gaussians(BOX, mean, np.array([[8.0, 8.0, 1e3]] * len(middles)), np.ones(len(middles)), (64, 64, 1))


def spectral(information: DensityGrid) -> SpectralMetric:
    """The paper's metric."""
    return SpectralMetric.of(information.coefficients(MODES), MetricWeights.LINEAR)


def task_for(metric: ControlMetric, transport: Transport = Transport.OWN_SCORE) -> ControlTask:
    """The multirotor and its tree."""
    return ControlTask.of(
        BOX,
        metric,
        Multirotor(8.0, 2.0, 2.0, 4.0, 0.8),
        GaussianPrior(1.0),
        obstacles=ObstacleField.of([Cylinder(TREE, TREE_RADIUS_M, 0.0, 20.0)]),
        keep_out_m=KEEP_OUT_M,
        control_s=PERIOD_S,
        transport=transport,
    )


def near(flight: Flight, place: tuple[float, float], half: int) -> float:
    """Share of one half of a flight within 20 m of a place."""
    part = flight.positions_m[: STEPS // 2] if half == 0 else flight.positions_m[STEPS // 2 :]
    return float((np.linalg.norm(part[:, :2] - place, axis=1) < 20.0).mean())


def main() -> None:
    """Print and draw."""
    before, after = places(OLD, STAYS), places(NEW, STAYS)
    found: dict[str, list[Flight]] = {}
    for name, transport, candidates, remembers in (
        ("own scores, N = 12", Transport.OWN_SCORE, 12, True),
        ("own scores, N = 20", Transport.OWN_SCORE, 20, True),
        ("own scores, N = 12, no memory", Transport.OWN_SCORE, 12, False),
        ("paper's φ, N = 12", Transport.STEIN, 12, True),
        ("paper's φ, N = 20", Transport.STEIN, 20, True),
    ):
        tasks = [task_for(spectral(information), transport) for information in (before, after)]
        found[name] = [
            fly(
                lambda index, tasks=tasks: tasks[index >= STEPS // 2],
                [10.0, 10.0, 10.0, 0.0, 0.0, 0.0, 0.0],
                STEPS,
                candidates,
                HORIZON,
                seed,
                remembers,
            )
            for seed in range(SEEDS)
        ]

    def second_half(flights: list[Flight]) -> float:
        return float(np.median([ergodic_metric(f.positions_m[STEPS // 2 :], after, MODES, BOX) for f in flights]))

    def line(name: str) -> str:
        flights = found[name]
        clear = min(
            float(np.linalg.norm(f.positions_m[:, :2] - TREE, axis=1).min()) - TREE_RADIUS_M - KEEP_OUT_M
            for f in flights
        )
        return (
            f"{name}: near the new place {np.median([near(f, NEW, 0) for f in flights]):.0%} of the time before, "
            f"{np.median([near(f, NEW, 1) for f in flights]):.0%} after; E of that half {second_half(flights):.3f}; "
            f"least clearance to spare {clear:+.2f} m; horizon clear in {np.mean([f.safe_share for f in flights]):.0%}"
        )

    own, printed = found["own scores, N = 12"], found["paper's φ, N = 12"]
    arrived = float(np.median([near(flight, NEW, 1) for flight in own]))
    ratio = second_half(printed) / second_half(own)
    lines = "\n         ".join(line(name) for name in found)
    print_claims(
        6,
        "the information moves",
        [
            (
                "online adaptation in a model-predictive formulation, N = 12 (or 20)",
                lines,
                f"{'holds' if arrived > 0.25 else 'does not hold'} with own scores; with the paper's φ on controls, "
                f"where candidates take each other's scores, E is {ratio:.1f} times as much",
            )
        ],
    )
    figure, axes = plt.subplots(1, 2, figsize=(7.5, 3.6))
    shown = found["own scores, N = 12"][0].positions_m
    for index, (axis, title) in enumerate(zip(axes, ("before", "after the information moved"), strict=True)):
        part = shown[: STEPS // 2 + 1] if index == 0 else shown[STEPS // 2 :]
        mass = (before, after)[index].mass[:, :, 0].T
        axis.imshow(mass, origin="lower", extent=(0.0, 100.0, 0.0, 100.0), cmap="Blues")
        axis.add_patch(plt.Circle(TREE, TREE_RADIUS_M, color="0.6"))
        axis.plot(part[:, 0], part[:, 1], color="tab:red", linewidth=1.0)
        axis.set(title=title, xticks=[], yticks=[])
        axis.title.set_fontsize(9)
    save(figure, "figure_06_adaptation")


if __name__ == "__main__":
    main()
