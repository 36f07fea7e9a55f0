"""`[sensor]`, `[belief]`, `[flight]`, `[replanning]`, `[link]`: how the path is flown and what is seen on the way."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from mission.findings import Finding
from mission.mission_file.values import InputFile, Length, Section
from sim_bridge.link.address import parse_address


class Sensor(Section):
    """What the vehicle sees of the ground below it."""

    detection_radius_m: Annotated[Length | None, Field(examples=[33.0])] = None
    """Radius of the disc that is seen (a 45° camera at 80 m sees 33 m); absent: no model of what is seen."""
    detection_probability: Annotated[float, Field(ge=0.001, le=1.0)] = 0.9
    """Chance that what is in the disc is noticed in one pass."""
    rate_hz: Annotated[float, Field(ge=0.001, le=1000.0)] = 1.0
    """How often it looks: often enough that no ground between two looks is passed over."""

    @property
    def swath_m(self) -> float | None:
        """Width of the strip that one pass sees."""
        return None if self.detection_radius_m is None else 2.0 * self.detection_radius_m


class Belief(Section):
    """What is known, and how flying changes it."""

    kind: Literal["memory", "detection"] = "memory"
    """`memory`: the information stays and covered ground is remembered. `detection`: ground that was seen without a
    find becomes less probable, time is shared out as an orderly search's effort (Koopman, Stone), and paths are planned
    for what they find."""


class Flight(Section):
    """How the path is flown."""

    clearance_margin_m: Annotated[float, Field(ge=0.0, le=1000.0)] = 1.0
    """Least distance from the vehicle's hull to every obstacle."""
    takeoff_altitude_m: Annotated[float | None, Field(gt=0.0, le=10_000.0, examples=[30.0])] = None
    """Height to climb to, above where the vehicle stands, before flying to the start; absent: the start's."""
    stream_rate_hz: Annotated[float, Field(ge=4.0, le=200.0)] = 20.0
    """Setpoints a second; PX4 leaves Offboard below 2 Hz."""
    mode: Literal["offboard", "mission"] = "offboard"
    """Stream setpoints, or upload waypoints."""
    end: Literal["return", "land"] = "return"
    """After the path: fly home and land there, or land where it ends."""
    reserve_fraction: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.15
    """Part of the endurance that is kept for what nobody planned."""


class Replanning(Section):
    """How the path changes while it is flown."""

    enabled: bool = True
    """Whether it changes at all."""
    period_s: Annotated[float, Field(ge=0.1, le=3600.0)] = 1.0
    """Time between replans."""


class Link(Section):
    """How the vehicle is reached."""

    address: Annotated[str, Field(examples=["udp://127.0.0.1:14540"])] = "sim"
    """`sim` starts the built-in vehicle; else `udp://…`, `tcp://…` or `serial://…`."""
    system_id: Annotated[int, Field(ge=1, le=255)] = 1
    """MAVLink system id of the vehicle."""
    ready_timeout_s: Annotated[float, Field(ge=1.0, le=3600.0)] = 120.0
    """How long to wait until the vehicle is ready to arm (PX4 takes 36 s after boot)."""
    signing_key_file: InputFile | None = None
    """File with the MAVLink 2 signing key; absent: nothing is signed."""

    def findings(self) -> Iterator[Finding]:
        """An address that leads somewhere."""
        if self.address == "sim":
            return
        try:
            parse_address(self.address)
        except ValueError as error:
            got = f'"{self.address}"'
            yield Finding("address", got, f'{str(error).removeprefix(got).strip()}, or "sim"')
