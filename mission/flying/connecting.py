"""The vehicle of a flight: reached over its link, or the built-in one, started and set as a real one should be."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from mission.flying.clock import FlightClock
from mission.flying.flight_progress import Watcher
from mission.flying.preflight import reach_of
from mission.flying.vehicle_settings import Reach
from mission.mission_file import Mission
from mission.planning import Planned
from mission.site.fence import planned_fence
from sim_bridge.ardupilot.defaults import PARAMETERS as COPTER
from sim_bridge.dialects import Autopilot
from sim_bridge.frames import geodetic_from_enu
from sim_bridge.link.client import Link
from sim_bridge.link.commands import OWN_SYSTEM
from sim_bridge.px4.defaults import PARAMETERS as PX4

SIM = "sim"
"""The address of the built-in vehicle."""

_HEARD_WITHIN_S = 30.0
_CENTI = 100.0
_GROUND_STATION_TIMEOUT_S = 5.0


@contextlib.contextmanager
def vehicle_of(planned: Planned, address: str, speed: float, watcher: Watcher, clock: FlightClock) -> Iterator[Link]:
    """The vehicle, connected; the built-in one is started and ended.

    Args:
        planned: What is flown.
        address: "sim", or the vehicle's address.
        speed: How fast the built-in vehicle's time runs.
        watcher: Told what happens.
        clock: Follows the vehicle's.

    Raises:
        LinkError: The vehicle cannot be reached.
        ValueError: Its address or its signing key cannot be read.
    """
    mission = planned.mission
    with contextlib.ExitStack() as stack:
        if address == SIM:
            from sim_bridge.simulator import spawn
            from sim_bridge.vehicle.airframes import AirframeKind

            small = mission.vehicle.preset == "crazyflie"
            simulator = spawn(
                geodetic_from_enu(mission.home_enu_m, mission.site.origin.point()),
                speed=speed,
                parameters=as_told(
                    mission, reach_of(planned.problem, planned_fence(mission.site), mission.home_enu_m), speed
                ),
                endurance_s=mission.vehicle.endurance_s,
                autopilot=Autopilot[mission.vehicle.autopilot.upper()],
                kind=AirframeKind.CRAZYFLIE if small else AirframeKind.QUADROTOR,
                # What setpoints lean against must be there.
                drag_per_s=mission.vehicle.drag_per_s or None,
                # Indoors a vehicle knows its place to centimetres, under GPS to the better part of a metre.
                wander_m=0.02 if small else 0.8,
            )
            stack.callback(simulator.stop)
            address = simulator.address
        watcher.say(f"connecting to {address}", warning=False)
        link = Link.connect(
            address,
            mission.site.origin.point(),
            vehicle_system=mission.link.system_id,
            key_file=mission.link.signing_key_file,
            timeout_s=min(_HEARD_WITHIN_S, mission.link.ready_timeout_s),
            on_state=clock.hear,
        )
        stack.callback(link.close)
        yield link


def as_told(mission: Mission, reach: Reach, speed: float) -> tuple[tuple[str, float], ...]:
    """The built-in vehicle's parameters, set as docs/flying.md tells a team to set a real one's."""
    vehicle = mission.vehicle
    match Autopilot[vehicle.autopilot.upper()]:
        case Autopilot.PX4:
            return (
                ("COM_OBL_RC_ACT", 5.0),
                ("COM_LOW_BAT_ACT", 3.0),
                ("RTL_RETURN_ALT", max(PX4["RTL_RETURN_ALT"], reach.clear_up_m)),
                # Its own return is as fast as the mission.
                ("MPC_XY_CRUISE", vehicle.max_speed_mps),
                ("MPC_XY_VEL_MAX", vehicle.max_speed_mps),
                ("MPC_Z_VEL_MAX_UP", vehicle.max_climb_mps),
                ("MPC_Z_VEL_MAX_DN", vehicle.max_descent_mps),
            )
        case Autopilot.ARDUPILOT:
            return (
                ("FENCE_ENABLE", 1.0),
                ("FENCE_TYPE", 4.0),
                ("FS_GCS_ENABLE", 1.0),
                ("SYSID_MYGCS", float(OWN_SYSTEM)),
                # Heartbeats come once a second of this machine's time, however fast the vehicle's runs.
                ("FS_GCS_TIMEOUT", _GROUND_STATION_TIMEOUT_S * max(1.0, speed)),
                ("BATT_FS_LOW_ACT", 2.0),
                ("RTL_ALT", max(COPTER["RTL_ALT"], _CENTI * reach.clear_up_m)),
                ("WPNAV_SPEED", _CENTI * vehicle.max_speed_mps),
                ("WPNAV_SPEED_UP", _CENTI * vehicle.max_climb_mps),
                ("WPNAV_SPEED_DN", _CENTI * vehicle.max_descent_mps),
            )
