"""Makes faults happen: on the vehicle, and on the line to it."""

from __future__ import annotations

import collections
from collections.abc import Callable, Sequence

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

    Of several of a kind that last at the same time the one that began last counts; when it is over, the one before it
    again. Second stations all talk.

    Args:
        faults: What is to happen; those of other vehicles are left out.
        autopilot: To whom.
        channels: The line to it and from it.
        sign: Signs a frame with the vehicle's key; None: it has none.

    Raises:
        ValueError: A station that signs with the key of a vehicle that has none.
    """

    def __init__(
        self,
        faults: Sequence[AnyFault],
        autopilot: VehicleAutopilot,
        channels: tuple[Channel, Channel],
        sign: Callable[[bytes], bytes] | None = None,
    ) -> None:
        own = autopilot.body.config.system
        mine = [fault for fault in faults if fault.system in (0, own)]
        if sign is None and any(isinstance(fault, SecondStation) and fault.signed for fault in mine):
            raise ValueError(f"a second station signs with the vehicle's key, but vehicle {own} has none: give it one")
        self._waiting = collections.deque(sorted(mine, key=lambda fault: fault.begin_s))
        self._active: list[AnyFault] = []
        self._autopilot = autopilot
        self._channels = channels
        self._sign = sign
        self._line: Quality = channels[0].quality
        self._wind: Wind = autopilot.body.rotor.wind
        self._stations: list[tuple[SecondStation, OtherStation]] = []

    def advance(self, now_s: float) -> list[Message]:
        """Begin and end what is due; what the vehicle says about it."""
        told: list[Message] = []
        lasting = [fault for fault in self._active if fault.end_s > now_s]
        changed = len(lasting) < len(self._active)
        self._active = lasting
        while self._waiting and self._waiting[0].begin_s <= now_s:
            fault = self._waiting.popleft()
            told += self._happen(fault, now_s)
            if fault.end_s > now_s:
                self._active.append(fault)
                changed = True
        if changed:
            self._apply(now_s)
        if any(isinstance(fault, HeartbeatFrozen) for fault in self._active):
            # Each time anew: a boot in between would bring the heartbeats back.
            self._autopilot.services.streams.silent.add(mavlink.MAVLINK_MSG_ID_HEARTBEAT)
        inward, _ = self._channels
        for fault, station in self._stations:
            for datagram in station.tick(now_s):
                inward.put(self._sign(datagram) if fault.signed and self._sign is not None else datagram, now_s)
        return told

    def _happen(self, fault: AnyFault, now_s: float) -> list[Message]:
        """What is done once, when a fault begins."""
        autopilot, body = self._autopilot, self._autopilot.body
        match fault:
            case Reboot():
                autopilot.reboot(now_s, fault.outage_s, recovers_in_air=fault.recovers_in_air)
            case EstimatorJump():
                body.estimator.jump(fault.offset_ned_m)
            case BatteryDrop():
                body.rotor.battery = min(body.rotor.battery, fault.charge)
            case PilotSwitch():
                return autopilot.pilot_switches(fault.mode)
            case _:
                pass
        return []

    def _apply(self, now_s: float) -> None:
        """Make line and vehicle what the faults of this moment say, and all else what it was before any."""
        autopilot, body = self._autopilot, self._autopilot.body
        quality, wind, cut, has_gps = self._line, self._wind, False, True
        glitch_ned_m, thrust, refusal, frozen = (0.0, 0.0, 0.0), 1.0, "", False
        for fault in self._active:
            match fault:
                case BadLine():
                    quality = fault.quality()
                case LinkCut():
                    cut = True
                case GpsLoss():
                    has_gps = False
                case GpsGlitch():
                    glitch_ned_m = fault.offset_ned_m
                case WindChange():
                    wind = Wind(fault.mean_ned_mps, fault.gust_mps)
                case MotorDerating():
                    thrust = fault.thrust
                case ArmingRefused():
                    refusal = fault.reason
                case HeartbeatFrozen():
                    frozen = True
                case _:
                    pass
        for channel in self._channels:
            channel.quality, channel.cut = quality, cut
        if has_gps:
            body.estimator.regain_gps(now_s)
        else:
            body.estimator.lose_gps(now_s)
        body.estimator.gps_glitch_ned_m = glitch_ned_m
        body.rotor.wind, body.rotor.derating = wind, thrust
        autopilot.refusal = refusal
        if not frozen:
            autopilot.services.streams.silent.discard(mavlink.MAVLINK_MSG_ID_HEARTBEAT)
        talking = {id(fault): station for fault, station in self._stations}
        self._stations = [
            (fault, talking.get(id(fault)) or OtherStation(body.config.system, uploads=fault.uploads))
            for fault in self._active
            if isinstance(fault, SecondStation)
        ]
