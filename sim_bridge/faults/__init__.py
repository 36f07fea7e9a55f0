"""Faults on demand: what can go wrong, when it does, and how it is written down."""

from sim_bridge.faults.driver import FaultDriver
from sim_bridge.faults.kinds import (
    AnyFault,
    ArmingRefused,
    BadLine,
    BatteryDrop,
    EstimatorJump,
    GpsGlitch,
    GpsLoss,
    HeartbeatFrozen,
    LinkCut,
    MotorDerating,
    PilotSwitch,
    Reboot,
    SecondStation,
    WindChange,
)
from sim_bridge.faults.reading import parse_fault, read_faults

__all__ = [
    "AnyFault",
    "ArmingRefused",
    "BadLine",
    "BatteryDrop",
    "EstimatorJump",
    "FaultDriver",
    "GpsGlitch",
    "GpsLoss",
    "HeartbeatFrozen",
    "LinkCut",
    "MotorDerating",
    "PilotSwitch",
    "Reboot",
    "SecondStation",
    "WindChange",
    "parse_fault",
    "read_faults",
]
