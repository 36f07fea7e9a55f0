"""What can go wrong on purpose. Each fault is a value: what, when, how much.

Times count from the vehicle's first boot, whatever it goes through later.
"""

from __future__ import annotations

import dataclasses
import math
from typing import ClassVar, Literal

from pydantic import ConfigDict

from sim_bridge.channel import Quality
from sim_bridge.state import FlightMode, Vector

STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Fault:
    """What all faults have.

    Attributes:
        begin_s: When it begins.
        system: Which vehicle; 0: every one.

    Raises:
        ValueError: A time before the boot.
    """

    __pydantic_config__: ClassVar[ConfigDict] = STRICT
    begin_s: float
    system: int = 0

    def __post_init__(self) -> None:
        if not 0.0 <= self.begin_s < math.inf:
            raise ValueError(f"a fault begins at a time from 0 s on, got {self.begin_s}")

    @property
    def end_s(self) -> float:
        """When it is over; at once, for what only happens."""
        return self.begin_s


@dataclasses.dataclass(frozen=True, kw_only=True)
class Lasting(Fault):
    """A fault that goes on for a while.

    Attributes:
        duration_s: How long; None: to the end.

    Raises:
        ValueError: A duration that is not positive.
    """

    duration_s: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.duration_s is not None and not self.duration_s > 0.0:
            raise ValueError(f"a duration is positive, got {self.duration_s} s")

    @property
    def end_s(self) -> float:
        """When it is over."""
        return math.inf if self.duration_s is None else self.begin_s + self.duration_s


@dataclasses.dataclass(frozen=True, kw_only=True)
class BadLine(Lasting):
    """Datagrams are lost, doubled, out of order, late; both ways.

    Attributes:
        loss: Share that never arrives.
        duplication: Share that arrives twice.
        reordering: Share that later ones overtake.
        delay_s: Mean delay.
        jitter_s: Delays are spread evenly by so much to either side.
    """

    kind: Literal["bad-line"] = "bad-line"
    loss: float = 0.0
    duplication: float = 0.0
    reordering: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self.quality()

    def quality(self) -> Quality:
        """As a line has it."""
        return Quality(self.loss, self.duplication, self.delay_s, self.jitter_s, self.reordering)


@dataclasses.dataclass(frozen=True, kw_only=True)
class LinkCut(Lasting):
    """Nothing passes, either way."""

    kind: Literal["link-cut"] = "link-cut"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Reboot(Fault):
    """The autopilot starts anew.

    Attributes:
        outage_s: How long it says and controls nothing; in the air the vehicle falls.
        recovers_in_air: Whether, as after a watchdog's reset, the motors then run again and the vehicle lands.
    """

    kind: Literal["reboot"] = "reboot"
    outage_s: float = 0.5
    recovers_in_air: bool = True


@dataclasses.dataclass(frozen=True, kw_only=True)
class GpsLoss(Lasting):
    """No positions from GPS."""

    kind: Literal["gps-loss"] = "gps-loss"


@dataclasses.dataclass(frozen=True, kw_only=True)
class GpsGlitch(Lasting):
    """GPS lies, and the estimate follows it within seconds.

    Attributes:
        offset_ned_m: By how much.
    """

    kind: Literal["gps-glitch"] = "gps-glitch"
    offset_ned_m: Vector


@dataclasses.dataclass(frozen=True, kw_only=True)
class EstimatorJump(Fault):
    """The estimate is suddenly elsewhere, and stays there.

    Attributes:
        offset_ned_m: By how much.
    """

    kind: Literal["estimator-jump"] = "estimator-jump"
    offset_ned_m: Vector


@dataclasses.dataclass(frozen=True, kw_only=True)
class WindChange(Lasting):
    """Another wind.

    Attributes:
        mean_ned_mps: Where the air goes.
        gust_mps: Standard deviation of gusts.
    """

    kind: Literal["wind"] = "wind"
    mean_ned_mps: Vector = (0.0, 0.0, 0.0)
    gust_mps: float = 0.0


@dataclasses.dataclass(frozen=True, kw_only=True)
class BatteryDrop(Fault):
    """The battery suddenly has less in it.

    Attributes:
        charge: 0 … 1.

    Raises:
        ValueError: A charge outside of that.
    """

    kind: Literal["battery"] = "battery"
    charge: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.charge <= 1.0:
            raise ValueError(f"a battery's charge is 0 to 1, got {self.charge}")


@dataclasses.dataclass(frozen=True, kw_only=True)
class MotorDerating(Lasting):
    """The motors give less.

    Attributes:
        thrust: Share of the full thrust that is left; what hovers needs about half.

    Raises:
        ValueError: A share outside 0 … 1.
    """

    kind: Literal["motor-derating"] = "motor-derating"
    thrust: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.thrust <= 1.0:
            raise ValueError(f"a share of the thrust is 0 to 1, got {self.thrust}")


@dataclasses.dataclass(frozen=True, kw_only=True)
class PilotSwitch(Fault):
    """A pilot takes the transmitter, sticks centred, and chooses a mode.

    Attributes:
        mode: Which.
    """

    kind: Literal["pilot"] = "pilot"
    mode: FlightMode = FlightMode.PILOT


@dataclasses.dataclass(frozen=True, kw_only=True)
class SecondStation(Lasting):
    """Another ground station, system 255, talks to the vehicle on the same line.

    Attributes:
        uploads: Whether it begins to upload a mission, and never goes on.
        signed: Whether it signs with the vehicle's key; a vehicle with a key does not hear it otherwise.
    """

    kind: Literal["second-station"] = "second-station"
    uploads: bool = False
    signed: bool = False


@dataclasses.dataclass(frozen=True, kw_only=True)
class ArmingRefused(Lasting):
    """Something is wrong that only arming finds.

    Attributes:
        reason: What the vehicle says.
    """

    kind: Literal["arming-refused"] = "arming-refused"
    reason: str = "Preflight Fail: Compass Sensor 0 missing"


@dataclasses.dataclass(frozen=True, kw_only=True)
class HeartbeatFrozen(Lasting):
    """Heartbeats stop; all else goes on."""

    kind: Literal["heartbeat-frozen"] = "heartbeat-frozen"


AnyFault = (
    BadLine
    | LinkCut
    | Reboot
    | GpsLoss
    | GpsGlitch
    | EstimatorJump
    | WindChange
    | BatteryDrop
    | MotorDerating
    | PilotSwitch
    | SecondStation
    | ArmingRefused
    | HeartbeatFrozen
)
