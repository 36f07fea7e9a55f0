"""Receding-horizon control (SVES Alg. 2) as a library: no path is planned, every control step finds the next control.

python examples/control_multirotor.py

Nothing is proven here: this is the paper's second algorithm for those who compare with it. What flies is `mission fly`.
"""

import jax
import jax.numpy as jnp
import numpy as np

from planner import DensityGrid, MetricWeights, ObstacleField, Sphere, Workspace, control
from planner.dynamics import Multirotor
from planner.priors import OffsetPrior
from planner.spectral_metric import SpectralMetric, mean_basis, mode_weights

MODES = (8, 8, 2)
CONTROL_S, STEPS, CANDIDATES, HORIZON = 0.25, 240, 8, 20


def flown() -> tuple[np.ndarray, DensityGrid, ObstacleField]:
    """A minute of flight around a ball: positions in metres, shape (time, 3), what was to explore, and the ball."""
    hall = Workspace(np.zeros(3), np.array([30.0, 30.0, 10.0]))
    level = DensityGrid(hall, np.ones((30, 30, 10)))
    ball = ObstacleField.of([Sphere(np.array([15.0, 15.0, 5.0]), 4.0)])
    task = control.ControlTask.of(
        hall,
        SpectralMetric.of(level.coefficients(MODES), MetricWeights.LINEAR),
        Multirotor(
            max_speed_mps=4.0, max_climb_mps=2.0, max_descent_mps=1.5, max_acceleration_mps2=3.0, max_yaw_rate_radps=1.5
        ),
        OffsetPrior(0.5, 0.5),
        obstacles=ball,
        keep_out_m=1.0,
        control_s=CONTROL_S,
    )
    state = control.init(task, jax.random.key(0), CANDIDATES, HORIZON)
    # Position, velocity, heading.
    vehicle = jnp.array([3.0, 3.0, 3.0, 0.0, 0.0, 0.0, 0.0])
    path = [np.asarray(vehicle[:3])]
    for key in jax.random.split(jax.random.key(1), STEPS):
        state, info = control.step(task, state, vehicle, key)
        vehicle = task.dynamics.step(vehicle, info.control, CONTROL_S)
        path.append(np.asarray(vehicle[:3]))
    return np.array(path), level, ball


def main() -> None:
    """Fly, and say what came of it."""
    path, level, ball = flown()
    weight = np.full(len(path), 1.0 / len(path))
    residual = mean_basis(level.workspace.unit_from_enu(path), weight, MODES) - level.coefficients(MODES)
    metric = float(np.sum(mode_weights(MODES, MetricWeights.LINEAR) * residual**2))
    print(
        f"E {metric:.4f} after {STEPS * CONTROL_S:.0f} s, least distance to the ball {ball.distance(path).min():.2f} m"
    )


if __name__ == "__main__":
    main()
