"""A vehicle that flies, as telemetry tells it, and what its flying costs."""

from mission.executive.energy import Energy
from mission.site.descent import Descent
from sim_bridge.state import FlightMode, LandedState, VehicleState

ENERGY = Energy(1200.0, 0.15, 8.0, 3.0, Descent(1.5))
STATE = VehicleState(
    time_s=100.0,
    position_enu_m=(100.0, 0.0, 30.0),
    velocity_enu_mps=(0.0, 0.0, 0.0),
    yaw_enu_rad=0.0,
    armed=True,
    mode=FlightMode.EXTERNAL,
    mode_name="OFFBOARD",
    landed=LandedState.IN_AIR,
    battery_fraction=0.8,
    waiting_for=(),
    failsafe=False,
    home_enu_m=(0.0, 0.0, 0.0),
)
