"""Makes faults happen: on the vehicle, and on the line to it."""

from __future__ import annotations

from collections.abc import Sequence

from sim_bridge.channel import Channel, Quality
from sim_bridge.codec import Message, mavlink
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
from sim_bridge.faults.second_station import OtherStation
from sim_bridge.vehicle.autopilot import VehicleAutopilot
from sim_bridge.vehicle.kinematics import Wind


class FaultDriver:
    """Begins and ends faults when their time comes.

    Args:
        faults: What is to happen; those of other vehicles are left out.
        autopilot: To whom.
        channels: Both directions of its line.
    """

    def __init__(
        self, faults: Sequence[AnyFault], autopilot: VehicleAutopilot, channels: tuple[Channel, Channel]
    ) -> None:
        own = autopilot.body.config.system
        mine = [fault for fault in faults if fault.system in (0, own)]
        self._waiting = sorted(mine, key=lambda fault: fault.begin_s, reverse=True)
        self._active: list[AnyFault] = []
        self._autopilot = autopilot
        self._channels = channels
        self._line: Quality = channels[0].quality
        self._wind: Wind = autopilot.body.rotor.wind
        self._station: OtherStation | None = None

    def advance(self, now_s: float) -> list[Message]:
        """Begin and end what is due; what the vehicle says about it."""
        told: list[Message] = []
        over = [fault for fault in self._active if fault.end_s <= now_s]
        for fault in over:
            self._active.remove(fault)
            self._end(fault, now_s)
        while self._waiting and self._waiting[-1].begin_s <= now_s:
            fault = self._waiting.pop()
            told += self._begin(fault, now_s)
            if fault.end_s > now_s:
                self._active.append(fault)
        if any(isinstance(fault, HeartbeatFrozen) for fault in self._active):
            # Each time anew: a boot in between would bring the heartbeats back.
            self._autopilot.services.streams.silent.add(mavlink.MAVLINK_MSG_ID_HEARTBEAT)
        if self._station is not None:
            for message in self._station.tick(now_s):
                told += self._autopilot.receive(message, now_s)
        return told

    def _begin(self, fault: AnyFault, now_s: float) -> list[Message]:
        autopilot, body = self._autopilot, self._autopilot.body
        match fault:
            case BadLine():
                self._set_line(fault.quality())
            case LinkCut():
                self._set_cut(True)
            case Reboot():
                autopilot.reboot(now_s, fault.outage_s, recovers_in_air=fault.recovers_in_air)
            case GpsLoss():
                body.estimator.lose_gps(now_s)
            case GpsGlitch():
                body.estimator.gps_glitch_ned_m = fault.offset_ned_m
            case EstimatorJump():
                body.estimator.jump(fault.offset_ned_m)
            case WindChange():
                body.rotor.wind = Wind(fault.mean_ned_mps, fault.gust_mps)
            case BatteryDrop():
                body.rotor.battery = min(body.rotor.battery, fault.charge)
            case MotorDerating():
                body.rotor.derating = fault.thrust
            case PilotSwitch():
                return autopilot.pilot_switches(fault.mode)
            case SecondStation():
                self._station = OtherStation(body.config.system, uploads=fault.uploads)
            case ArmingRefused():
                autopilot.refusal = fault.reason
            case HeartbeatFrozen():
                pass
        return []

    def _end(self, fault: AnyFault, now_s: float) -> None:
        autopilot, body = self._autopilot, self._autopilot.body
        match fault:
            case BadLine():
                self._set_line(self._line)
            case LinkCut():
                self._set_cut(False)
            case GpsLoss():
                body.estimator.regain_gps(now_s)
            case GpsGlitch():
                body.estimator.gps_glitch_ned_m = (0.0, 0.0, 0.0)
            case WindChange():
                body.rotor.wind = self._wind
            case MotorDerating():
                body.rotor.derating = 1.0
            case SecondStation():
                self._station = None
            case ArmingRefused():
                autopilot.refusal = ""
            case HeartbeatFrozen():
                autopilot.services.streams.silent.discard(mavlink.MAVLINK_MSG_ID_HEARTBEAT)
            case Reboot() | EstimatorJump() | BatteryDrop() | PilotSwitch():
                pass

    def _set_line(self, quality: Quality) -> None:
        for channel in self._channels:
            channel.quality = quality

    def _set_cut(self, cut: bool) -> None:
        for channel in self._channels:
            channel.cut = cut
