"""`[vehicle]`: what flies, and what it can do."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from mission.mission_file.values import Section

PresetName = Literal["px4-quadrotor", "ardupilot-quadrotor", "crazyflie", "fixed-wing"]

DEFAULT_PRESET: PresetName = "px4-quadrotor"

PRESETS: dict[str, dict[str, float | str]] = {
    # Two thirds of PX4's default MPC_XY_VEL_MAX (12 m/s), so that a third is left against wind and for catching up;
    # climb, descent and acceleration are MPC_Z_VEL_MAX_UP, MPC_Z_VEL_MAX_DN and MPC_ACC_HOR.
    "px4-quadrotor": {
        "autopilot": "px4",
        "max_speed_mps": 8.0,
        "max_climb_mps": 3.0,
        "max_descent_mps": 1.5,
        "max_acceleration_mps2": 3.0,
        "max_yaw_rate_degps": 45.0,
        "radius_m": 0.4,
        "endurance_s": 1200.0,
    },
    # WPNAV_SPEED 10 m/s, _UP 2.5, _DN 1.5, WPNAV_ACCEL 2.5 m/s² are Copter's defaults.
    "ardupilot-quadrotor": {
        "autopilot": "ardupilot",
        "max_speed_mps": 8.0,
        "max_climb_mps": 2.5,
        "max_descent_mps": 1.5,
        "max_acceleration_mps2": 2.5,
        "max_yaw_rate_degps": 45.0,
        "radius_m": 0.4,
        "endurance_s": 1200.0,
    },
    # Crazyflie 2.1: 0.5 m/s is comfortable and 1.0 the limit indoors; seven minutes of battery.
    "crazyflie": {
        "autopilot": "px4",
        "max_speed_mps": 0.5,
        "max_climb_mps": 0.5,
        "max_descent_mps": 0.5,
        "max_acceleration_mps2": 2.0,
        "max_yaw_rate_degps": 120.0,
        "radius_m": 0.07,
        "endurance_s": 420.0,
    },
    # A small survey aircraft: FW_AIRSPD_MAX 20 m/s, FW_T_CLMB_MAX 5, FW_T_SINK_MAX 5; a 35° bank is 6.9 m/s².
    "fixed-wing": {
        "autopilot": "px4",
        "max_speed_mps": 18.0,
        "max_climb_mps": 4.0,
        "max_descent_mps": 4.0,
        "max_acceleration_mps2": 6.0,
        "max_yaw_rate_degps": 25.0,
        "max_turn_rate_degps": 25.0,
        "radius_m": 1.0,
        "endurance_s": 3600.0,
    },
}


class Vehicle(Section):
    """What flies; entries that are not given come from the preset."""

    preset: PresetName = DEFAULT_PRESET
    """Whose figures the other entries start from. `fixed-wing` is for planning and exports alone: paths start and end
    at rest, and in between they may be slower than a wing flies, which `mission plan` warns of; `mission fly` refuses
    it."""
    autopilot: Literal["px4", "ardupilot"]
    """Whose dialect it speaks."""
    max_speed_mps: Annotated[float, Field(ge=0.01, le=100.0, examples=[8.0])]
    """Greatest speed, in any direction."""
    max_climb_mps: Annotated[float, Field(ge=0.01, le=50.0, examples=[3.0])]
    """Greatest speed upwards."""
    max_descent_mps: Annotated[float, Field(ge=0.01, le=50.0, examples=[1.5])]
    """Greatest speed downwards."""
    max_acceleration_mps2: Annotated[float, Field(ge=0.01, le=50.0, examples=[3.0])]
    """Greatest acceleration, in any direction."""
    max_jerk_mps3: Annotated[float | None, Field(ge=0.01, le=1000.0, examples=[8.0])] = None
    """Greatest change of the acceleration, in any direction; absent: no limit (PX4's own is `MPC_JERK_AUTO`)."""
    max_yaw_rate_degps: Annotated[float, Field(ge=0.01, le=720.0, examples=[45.0])]
    """Greatest rate of the heading."""
    max_turn_rate_degps: Annotated[float | None, Field(ge=0.01, le=720.0, examples=[25.0])] = None
    """Greatest rate at which the path turns on the map, for what cannot turn on the spot; absent: no limit."""
    speed_reserve: Annotated[float, Field(ge=0.0, le=0.5)] = 0.06
    """Part of the three speeds that plans leave to the vehicle, for catching up and against wind."""
    drag_per_s: Annotated[float, Field(ge=0.0, le=2.0)] = 0.0
    """Deceleration per speed through the air. PX4 is told to lean against it, and is then nearer to its path where that
    turns and where its speed changes; Copter has no place for it in its setpoints, and is told nothing. A flight's
    report says what the flight showed; PX4's simulated quadrotor has 1. The built-in vehicle has what is given here."""
    radius_m: Annotated[float, Field(ge=0.0, le=50.0, examples=[0.4])]
    """From its middle to its outermost part."""
    endurance_s: Annotated[float, Field(ge=1.0, le=1e6, examples=[1200.0])]
    """How long it flies on a full battery."""

    @model_validator(mode="before")
    @classmethod
    def _from_preset(cls, data: Any) -> Any:
        """Fills what is not given; a preset that does not exist is reported alone, not as eight missing entries."""
        if not isinstance(data, dict):
            return data
        preset = data.get("preset", DEFAULT_PRESET)
        figures = PRESETS.get(preset, PRESETS[DEFAULT_PRESET]) if isinstance(preset, str) else PRESETS[DEFAULT_PRESET]
        return {**figures, **data}
