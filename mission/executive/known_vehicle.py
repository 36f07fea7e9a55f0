"""What is kept of everything a vehicle told: its last state, its home, what it consumes, since when it is down."""

from __future__ import annotations

from mission.executive import readings
from mission.executive.energy import Consumption, Energy
from mission.executive.phases import AIRBORNE, Phase
from sim_bridge.state import FlightMode, LandedState, Vector, VehicleState


class KnownVehicle:
    """The vehicle as far as it was heard.

    Args:
        energy: What flying costs.
    """

    def __init__(self, energy: Energy) -> None:
        self._energy = energy
        self._grounded_since_s: float | None = None
        self.state: VehicleState | None = None
        self.heard_s: float | None = None
        self.mode_before = FlightMode.OTHER
        self.home_m: Vector | None = None
        # Height at which it last stood, mission frame: it is heard to stand before it takes off.
        self.stood_up_m = 0.0
        self.consumption: Consumption | None = None

    @property
    def mode(self) -> FlightMode:
        """What it was last seen doing."""
        return self.state.mode if self.state is not None else FlightMode.OTHER

    @property
    def down(self) -> bool:
        """Whether it was last seen on the ground."""
        return self._grounded_since_s is not None

    @property
    def unsteered(self) -> bool:
        """Whether nobody steers it, as far as its mode tells: it waits for setpoints, holds, or acts on a failsafe."""
        return self.state is not None and readings.unsteered(self.state)

    def hear(self, state: VehicleState, phase: Phase, now_s: float) -> None:
        """Take in what it tells.

        Args:
            state: What it tells.
            phase: What the flight is doing meanwhile.
            now_s: Flight clock.
        """
        if self.state is not None and self.state.mode is not state.mode:
            self.mode_before = self.state.mode
        self.state, self.heard_s = state, now_s
        if state.landed is not LandedState.ON_GROUND:
            self._grounded_since_s = None
        elif self._grounded_since_s is None:
            self._grounded_since_s = now_s
        if self.down:
            self.stood_up_m = state.position_enu_m[2]
        if state.home_enu_m is not None:
            self.home_m = state.home_enu_m
        elif phase is Phase.ARMING and not state.armed:
            self.home_m = state.position_enu_m
        told = state.battery_fraction
        # From arming on: the first look at the charge in the air must not find that it was never told.
        if told is None or not (state.armed or phase in AIRBORNE):
            return
        consumption = self.consumption or Consumption.begin(told, now_s, self._energy)
        self.consumption = consumption.observed(told, now_s, self._energy)

    def grounded_s(self, now_s: float) -> float:
        """How long it has been on the ground without a break, flight seconds."""
        return 0.0 if self._grounded_since_s is None else now_s - self._grounded_since_s
