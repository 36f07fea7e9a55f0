"""The planner as a library: proven paths from arrays, without a mission file, MAVLink or a vehicle.

python examples/plan_from_arrays.py
"""

import numpy as np

from planner import DensityGrid, Limits, Motion, ObstacleField, Options, Problem, Sphere, Workspace, solve


def problem() -> Problem:
    """Two places of interest in a hall of 40 × 30 × 10 m, a ball between them, a minute of flight."""
    hall = Workspace(np.zeros(3), np.array([40.0, 30.0, 10.0]))
    cells = DensityGrid(hall, np.ones((40, 30, 10)))
    places = np.array([[10.0, 8.0, 3.0], [30.0, 22.0, 6.0]])
    apart_m = np.linalg.norm(cells.centers_m()[..., None, :] - places, axis=-1)
    return Problem(
        workspace=hall,
        information=DensityGrid(hall, np.exp(-((apart_m / 5.0) ** 2)).sum(axis=-1)),
        obstacles=ObstacleField.of([Sphere(np.array([20.0, 15.0, 5.0]), 4.0)]),
        limits=Limits(max_speed_mps=3.0, max_climb_mps=1.5, max_descent_mps=1.0, max_acceleration_mps2=2.0),
        start=Motion.at_rest(np.array([2.0, 2.0, 2.0])),
        end_position_m=None,
        duration_s=60.0,
        vehicle_radius_m=0.4,
        clearance_margin_m=1.0,
    )


def main() -> None:
    """Plan, and say what came of it."""
    plan = solve(problem(), Options(candidates=8, modes=(8, 8, 4)))
    print(f"{plan.status.value}: {sum(one.feasible for one in plan.candidates)} of {len(plan.candidates)} proven,")
    print(f"{plan.diversity.effective_plans:.1f} of them distinct; selected: number {plan.selected}")
    best = plan.best
    print(f"E {best.ergodic_metric:.4f}, the lawnmower of its length {plan.lawnmower_ergodic_metric:.4f}")
    print(f"length {best.report.length_m:.0f} m, least clearance {best.report.min_clearance_m:.2f} m")
    moments = best.trajectory.sample(np.arange(0.0, 60.0, 10.0))
    for position, velocity in zip(moments.position_m, moments.velocity_mps, strict=True):
        print("at", np.round(position, 2), "m with", np.round(velocity, 2), "m/s")


if __name__ == "__main__":
    main()
