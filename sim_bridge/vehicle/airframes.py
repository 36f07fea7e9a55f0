"""Airframes the built-in vehicle comes in."""

from __future__ import annotations

import dataclasses
import enum

from sim_bridge.vehicle.kinematics import Airframe


class AirframeKind(enum.Enum):
    """Which vehicle it is built like."""

    QUADROTOR = "quadrotor"
    """A quadrotor of some kilograms, with PX4's gains."""
    CRAZYFLIE = "crazyflie"
    """A Crazyflie 2.1: 27 g that turn within hundredths of a second, tilt limited to 20° by its firmware."""


def airframe(kind: AirframeKind, endurance_s: float, drag: float | None = None) -> Airframe:
    """What a vehicle of a kind can do.

    The Crazyflie's gains are its firmware's: 2 for position, and 25° of tilt per m/s of velocity error, which is
    4.3 m/s². Its lag is that of motors and attitude loop together.

    Args:
        kind: Which.
        endurance_s: Time a full battery hovers.
        drag: Deceleration per speed through the air, 1/s; None: the kind's own. PX4's simulated quadrotor (SIH) has
            1.0, far more than a real one, and lags accordingly; with as much this one lags like it.
    """
    match kind:
        case AirframeKind.QUADROTOR:
            frame = Airframe(endurance_s=endurance_s)
        case AirframeKind.CRAZYFLIE:
            frame = Airframe(
                max_acceleration_mps2=3.5,
                max_jerk_mps3=100.0,
                thrust_to_weight=1.9,
                position_gain=2.0,
                velocity_gain=4.3,
                integral_gain=0.8,
                lag_s=0.035,
                drag=0.1,
                endurance_s=endurance_s,
            )
    return frame if drag is None else dataclasses.replace(frame, drag=drag)
