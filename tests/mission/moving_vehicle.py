"""The vehicle of a rehearsed flight, moving as the built-in one does while it follows setpoints."""

import numpy as np

from sim_bridge.state import FlightMode, Setpoint, Vector
from sim_bridge.vehicle.kinematics import Airframe, Multirotor, Target, Wind
from tests.mission.rehearsed_flight import STEP_S, Vehicle

_MOTION_STEPS = 5
PX4_SIH_DRAG = 1.0
"""Deceleration per speed through the air of PX4's own simulation, 1/s."""


def _swapped(place: Vector) -> Vector:
    """ENU to NED, and back."""
    x, y, z = place
    return y, x, -z


class MovingVehicle(Vehicle):
    """Lags, overshoots and strays where the point of `rehearsed_flight` is always where it was told to be.

    Args:
        airframe: What it can do.
    """

    def __init__(self, airframe: Airframe) -> None:
        super().__init__()
        self.rotor = Multirotor(airframe, Wind())

    def step(self, setpoint: Setpoint | None, now_s: float) -> None:
        """Let time pass."""
        if not self.armed or self.mode is not FlightMode.EXTERNAL or setpoint is None:
            super().step(setpoint, now_s)
            return
        rotor = self.rotor
        rotor.position_ned_m = _swapped(tuple(self.position))
        rotor.velocity_ned_mps = _swapped(tuple(self.velocity))
        target = Target(
            _swapped(setpoint.position_enu_m),
            _swapped(setpoint.velocity_enu_mps),
            _swapped(setpoint.acceleration_enu_mps2),
        )
        for _ in range(_MOTION_STEPS):
            rotor.fly(target, STEP_S / _MOTION_STEPS)
        self.battery -= self.drain_per_s * STEP_S
        self.position = np.array(_swapped(rotor.position_ned_m))
        self.velocity = np.array(_swapped(rotor.velocity_ned_mps))
