"""An aircraft that cannot stop, a sphere in its way, and two modes of information on either side of it.

Taken: speed 8 … 12 m/s, turn rate 0.6 rad/s, flight path angle 20°, a sphere of 12 m in a box of 100 × 100 × 40 m. Open
loop: one set of N = 16 over 60 controls. Closed loop: receding horizon, N = 12, eight seeds.

python -m benchmarks.sves.figure_12_aircraft
"""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

from benchmarks.sves.flights import ergodic_metric, fly
from benchmarks.sves.report import print_claims, save
from planner import control
from planner.control import ControlTask
from planner.dynamics import Aircraft
from planner.information import gaussians
from planner.obstacles import ObstacleField, Sphere
from planner.priors import OffsetPrior
from planner.problem import MetricWeights
from planner.spectral_metric import SpectralMetric
from planner.workspace import Workspace

BOX = Workspace(np.zeros(3), np.array([100.0, 100.0, 40.0]))
MODES = (8, 8, 4)
CENTER, RADIUS_M, KEEP_OUT_M = np.array([50.0, 50.0, 20.0]), 12.0, 1.5
PLACES = np.array([[22.0, 50.0, 20.0], [78.0, 50.0, 20.0]])
AIRCRAFT = Aircraft(8.0, 12.0, float(np.deg2rad(20.0)), 0.3, 0.6)
START = [50.0, 8.0, 20.0, 0.0, float(np.pi / 2.0)]
STEPS, PERIOD_S, SEEDS = 200, 0.4, 8


def to_spare_m(positions: np.ndarray) -> float:
    """Least distance left to the sphere's keep-out and to the box's walls."""
    sphere = np.linalg.norm(positions - CENTER, axis=-1) - RADIUS_M - KEEP_OUT_M
    walls = np.minimum(positions, BOX.lengths_m - positions).min(axis=-1)
    return float(min(sphere.min(), walls.min()))


def visits(positions: np.ndarray) -> np.ndarray:
    """Share of the time within 18 m of each place, shape (place,)."""
    return (np.linalg.norm(positions[:, None] - PLACES, axis=-1) < 18.0).mean(axis=0)


def main() -> None:
    """Print and draw."""
    information = gaussians(BOX, PLACES, np.array([[8.0, 12.0, 6.0]] * 2), np.ones(2), (64, 64, 24))
    task = ControlTask.of(
        BOX,
        SpectralMetric.of(information.coefficients(MODES), MetricWeights.LINEAR),
        AIRCRAFT,
        OffsetPrior(0.7, 0.7),
        obstacles=ObstacleField.of([Sphere(CENTER, RADIUS_M)]),
        keep_out_m=KEEP_OUT_M,
        control_s=PERIOD_S,
    )
    patient = dataclasses.replace(task, iterations=400)
    state = control.init(patient, jax.random.key(0), 16, 60)
    _, info = control.step(patient, state, jnp.asarray(START, jnp.float32), jax.random.key(1))
    paths = np.asarray(info.candidates.positions_m)
    clear = np.asarray(info.candidates.clear_moments) == 60
    west = np.array([path[np.argmin(np.abs(path[:, 1] - 50.0)), 0] < 50.0 for path in paths])
    flights = [fly(lambda _: task, START, STEPS, 12, 30, seed) for seed in range(SEEDS)]
    shares = np.array([visits(flight.positions_m) for flight in flights])
    spare = min(to_spare_m(flight.positions_m) for flight in flights)
    figures = [ergodic_metric(flight.positions_m, information, MODES, BOX) for flight in flights]
    both = int((shares > 0.1).all(axis=1).sum())
    print_claims(
        12,
        "an aircraft around a sphere",
        [
            (
                "multi-modal: the set passes the sphere on either side",
                f"open loop, {clear.sum()} of 16 clear over the whole horizon, of these {int((west & clear).sum())} "
                f"first west and {int((~west & clear).sum())} first east; best E "
                f"{float(np.asarray(info.candidates.ergodic_metric)[clear].min()):.3f}",
                "holds" if (west & clear).any() and (~west & clear).any() else "does not hold",
            ),
            (
                "both modes of the information are visited, without a violation",
                f"closed loop, {both} of {SEEDS} flights spend over a tenth of their time at each place (median "
                f"{np.median(shares, axis=0)[0]:.0%} and {np.median(shares, axis=0)[1]:.0%}); least distance to spare "
                f"from keep-out and walls {spare:+.2f} m over all flights; E {np.median(figures):.3f}",
                "holds" if both == SEEDS and spare >= 0.0 else "does not hold in every flight",
            ),
        ],
    )
    figure = plt.figure(figsize=(13.0, 4.0))
    angle, height = np.mgrid[0.0 : 2.0 * np.pi : 24j, 0.0 : np.pi : 12j]
    ball = np.stack([np.cos(angle) * np.sin(height), np.sin(angle) * np.sin(height), np.cos(height)])
    for index, (title, shown) in enumerate(
        (("open loop: the clear ones", paths[clear]), ("closed loop: the first flight", flights[0].positions_m[None])),
        start=1,
    ):
        axes = figure.add_subplot(1, 3, index, projection="3d")
        axes.plot_surface(*(CENTER[:, None, None] + RADIUS_M * ball), color="0.7", alpha=0.6)
        axes.scatter(*PLACES.T, color="black", marker="*", s=60)
        for path in shown:
            axes.plot(*path.T, linewidth=0.8)
        axes.set_title(title, fontsize=9)
        axes.view_init(elev=55.0, azim=-90.0)
        axes.set_box_aspect(BOX.lengths_m)
        axes.tick_params(labelsize=6)
    axis = figure.add_subplot(1, 3, 3)
    for flight in flights:
        to_sphere = np.linalg.norm(flight.positions_m - CENTER, axis=1) - RADIUS_M
        axis.plot(np.arange(len(to_sphere)) * PERIOD_S, to_sphere, linewidth=0.8)
    axis.axhline(KEEP_OUT_M, color="tab:red", linestyle="--", linewidth=1.0)
    axis.set(title="distance to the sphere, all flights [m]", xlabel="time [s]", ylim=(0.0, None))
    axis.title.set_fontsize(9)
    save(figure, "figure_12_aircraft")


if __name__ == "__main__":
    main()
