"""Curves made by hand, through a gate that asks for no more than they keep to: what is flown has a proof."""

from planner.gate import ProvenTrajectory, prove
from planner.information import uniform
from planner.obstacles import ObstacleField
from planner.problem import Limits, Problem
from planner.trajectory import Trajectory
from planner.workspace import Workspace

ROOM_M = 1.0


def proven(curve: Trajectory) -> ProvenTrajectory:
    """A curve that comes to rest, proven in empty space for a vehicle without limits."""
    points = curve.control_points_m
    box = Workspace(points.min(axis=0) - ROOM_M, points.max(axis=0) + ROOM_M)
    return prove(
        curve,
        Problem(
            workspace=box,
            information=uniform(box, (2, 2, 2)),
            obstacles=ObstacleField.of([]),
            limits=Limits(1e4, 1e4, 1e4, 1e4, 1e4),
            start=curve.motion_at(curve.start_s),
            end_position_m=None,
            duration_s=curve.duration_s,
            vehicle_radius_m=0.0,
            clearance_margin_m=0.0,
        ),
    )
