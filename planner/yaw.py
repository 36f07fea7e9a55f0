"""Where the nose points along a path: where the vehicle goes or as it was planned, as fast as it can turn.

| symbol | identifier          | unit  | meaning                                      |
|--------|---------------------|-------|----------------------------------------------|
| ψ      | `yaw_enu_rad`       | rad   | counter-clockwise from east, continuous      |
| ψ*     | `wanted`            | rad   | direction of the horizontal velocity, or as planned |
| r      | `max_yaw_rate_radps`| rad/s | bound on |dψ/dt|                             |
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

HOVER_SPEED_MPS = 0.1
"""Below this horizontal speed the direction of travel means nothing and the heading is held."""


def headings(
    time_s: Float[np.ndarray, "time"],
    velocity_enu_mps: Float[np.ndarray, "time 3"],
    max_yaw_rate_radps: float,
    *,
    start_yaw_rad: float | None = None,
    planned_rad: Float[np.ndarray, "time"] | None = None,
    hover_speed_mps: float = HOVER_SPEED_MPS,
) -> Float[np.ndarray, "time"]:
    """The heading at each moment: along the horizontal velocity (held while hovering) or as planned, rate limited.

    The way round is the shorter one at every moment (a half turn goes counter-clockwise), so that a vehicle which
    circles faster than it can turn does not run up whole turns to catch up with.

    Args:
        time_s: Moments, increasing.
        velocity_enu_mps: Velocity at those moments.
        max_yaw_rate_radps: Greatest rate of the heading, positive.
        start_yaw_rad: Heading at the first moment; None: the first one wanted.
        planned_rad: The heading wanted at those moments; NaN, or None for all: where the vehicle goes.
        hover_speed_mps: Horizontal speed below which the heading is held.

    Returns:
        Radians counter-clockwise from east, without jumps of whole turns.

    Raises:
        ValueError: A rate that is not positive, or times that do not increase.
    """
    if not max_yaw_rate_radps > 0.0:
        raise ValueError(f"max_yaw_rate_radps must be positive, got {max_yaw_rate_radps}")
    interval = np.diff(time_s)
    if (interval <= 0.0).any():
        raise ValueError("times must increase: sample the path at different moments")
    east, north = velocity_enu_mps[:, 0], velocity_enu_mps[:, 1]
    moving = np.hypot(east, north) > hover_speed_mps
    wanted = np.arctan2(north, east)
    if planned_rad is not None:
        given = np.isfinite(planned_rad)
        moving, wanted = moving | given, np.where(given, planned_rad, wanted)
    if start_yaw_rad is None:
        start_yaw_rad = float(wanted[np.argmax(moving)]) if moving.any() else 0.0
    yaw = np.empty(len(time_s))
    yaw[0] = current = start_yaw_rad
    steps = zip((max_yaw_rate_radps * interval).tolist(), wanted[1:].tolist(), moving[1:].tolist(), strict=True)
    for index, (step, direction, moves) in enumerate(steps, start=1):
        if moves:
            turn = math.pi - (math.pi - (direction - current)) % (2.0 * math.pi)
            current += min(max(turn, -step), step)
        yaw[index] = current
    return yaw


def along_travel(position_m: Float[np.ndarray, "time 3"]) -> Float[np.ndarray, "time"]:
    """The direction of travel at each of equally long moments, of a vehicle that turns as fast as it likes.

    Args:
        position_m: Positions at those moments, two or more.

    Returns:
        Radians counter-clockwise from east, without jumps of whole turns; where the vehicle stands, as before.
    """
    east, north = np.gradient(position_m[:, :2], axis=0).T
    moving = np.hypot(east, north) > 0.0
    if not moving.any():
        return np.zeros(len(position_m))
    last = np.maximum.accumulate(np.where(moving, np.arange(len(moving)), np.argmax(moving)))
    return np.unwrap(np.arctan2(north, east)[last])
