"""How the vehicle returns by itself, from its own parameters; what it does not tell is as its autopilot comes."""

from __future__ import annotations

import math

from mission.executive.own_return import Cone, OwnReturn
from mission.flying.parameters import Parameter, Usual
from mission.site.descent import Descent
from sim_bridge.dialects import Autopilot

_CENTI, _MILLI = 0.01, 0.001
# Copter climbs to no less, however near home is.
_COPTER_LEAST_M = 2.0


def own_return_of(autopilot: Autopilot, parameter: Parameter) -> OwnReturn:
    """How a vehicle of either autopilot returns by itself."""
    match autopilot:
        case Autopilot.PX4:
            return px4_return(parameter)
        case Autopilot.ARDUPILOT:
            return copter_return(parameter)


def px4_return(parameter: Parameter) -> OwnReturn:
    """PX4's return, straight home (RTL_TYPE 0)."""
    known = Usual(parameter)
    down_mps = min(known.positive("MPC_Z_V_AUTO_DN", 1.5), known.positive("MPC_Z_VEL_MAX_DN", math.inf))
    half_angle_rad = math.radians(known("RTL_CONE_ANG", 45.0))
    conical = 0.0 < half_angle_rad < math.radians(89.0)
    # With a cone it crosses at no less than this, save within the radius itself, where it may climb less.
    least_m = 2.0 * known("NAV_ACC_RAD", 10.0) if conical else 0.0
    return OwnReturn(
        height_m=max(known("RTL_RETURN_ALT", 60.0), least_m),
        cruise_mps=min(known.positive("MPC_XY_CRUISE", 5.0), known.positive("MPC_XY_VEL_MAX", math.inf)),
        climb_mps=min(known.positive("MPC_Z_V_AUTO_UP", 3.0), known.positive("MPC_Z_VEL_MAX_UP", math.inf)),
        descent=Descent(down_mps, known.positive("MPC_LAND_SPEED", 0.7), known("MPC_LAND_ALT1", 10.0)),
        named="MPC_XY_CRUISE and RTL_RETURN_ALT",
        wait_s=max(0.0, known("RTL_LAND_DELAY", 0.0)),
        cone=Cone(1.0 / math.tan(half_angle_rad), known("RTL_MIN_DIST", 10.0), least_m) if conical else None,
    )


def px4_stays_up(parameter: Parameter) -> str | None:
    """Why a return of PX4 does not end on the ground; None: it does."""
    delay_s = parameter("RTL_LAND_DELAY")
    if delay_s is None or delay_s >= 0.0:
        return None
    return f"RTL_LAND_DELAY is {delay_s:g}: the vehicle's own return never lands; set it to 0"


def copter_return(parameter: Parameter) -> OwnReturn:
    """Copter's return."""
    known = Usual(parameter)
    slope = known("RTL_CONE_SLOPE", 3.0)
    return OwnReturn(
        height_m=_CENTI * known("RTL_ALT", 1500.0),
        cruise_mps=_CENTI * (known("RTL_SPEED", 0.0) or known.positive("WPNAV_SPEED", 1000.0)),
        climb_mps=_CENTI * known.positive("WPNAV_SPEED_UP", 250.0),
        descent=Descent(
            _CENTI * (known("LAND_SPEED_HIGH", 0.0) or known.positive("WPNAV_SPEED_DN", 150.0)),
            _CENTI * known.positive("LAND_SPEED", 50.0),
            _CENTI * known("LAND_ALT_LOW", 1000.0),
        ),
        named="RTL_SPEED and RTL_ALT",
        wait_s=_MILLI * known("RTL_LOIT_TIME", 5000.0),
        cone=Cone(slope, math.inf, _COPTER_LEAST_M) if slope > 0.0 else None,
    )


def copter_stays_up(parameter: Parameter) -> str | None:
    """Why a return of Copter does not end on the ground; None: it does."""
    final_cm = parameter("RTL_ALT_FINAL")
    if not final_cm:
        return None
    return (
        f"RTL_ALT_FINAL is {final_cm:g}: the vehicle's own return ends {_CENTI * final_cm:g} m above home and never "
        "lands; set it to 0"
    )
