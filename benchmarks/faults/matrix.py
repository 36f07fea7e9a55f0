"""The cells of the fault matrix, and how one of them is flown and judged."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import random
from collections.abc import Callable, Iterator

from benchmarks.faults.pushed import ObstaclePushed
from benchmarks.faults.rehearsal import REPLAN_EVERY_S, REPLAN_TAKES_S, Rehearsal, Rehearsed
from mission.executive.phases import FINAL, Phase
from sim_bridge.dialects import Autopilot
from sim_bridge.faults import (
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
from sim_bridge.state import FlightMode

PX4_LEVELS_S = 3.0
MOMENTS = ("take-off", "follow", "replan", "return")

Make = Callable[[float, random.Random], AnyFault | ObstaclePushed]

FAULTS: dict[str, Make] = {
    "20 % loss, 200 ± 100 ms": lambda at, _: BadLine(
        begin_s=at, loss=0.2, delay_s=0.2, jitter_s=0.1, duplication=0.05, reordering=0.05
    ),
    "link cut, 3 s": lambda at, _: LinkCut(begin_s=at, duration_s=3.0),
    "link cut, 30 s": lambda at, _: LinkCut(begin_s=at, duration_s=30.0),
    "link cut for good": lambda at, _: LinkCut(begin_s=at),
    "autopilot reboot": lambda at, _: Reboot(begin_s=at),
    "GPS loss, 15 s": lambda at, _: GpsLoss(begin_s=at, duration_s=15.0),
    "GPS glitch": lambda at, rng: GpsGlitch(begin_s=at, duration_s=8.0, offset_ned_m=_aside(rng, 4.0)),
    "estimator jump": lambda at, rng: EstimatorJump(begin_s=at, offset_ned_m=_aside(rng, 2.0)),
    "wind 9 m/s, gusts": lambda at, rng: WindChange(begin_s=at, mean_ned_mps=_aside(rng, 9.0), gust_mps=1.5),
    "battery low": lambda at, _: BatteryDrop(begin_s=at, charge=0.2),
    "battery critical": lambda at, _: BatteryDrop(begin_s=at, charge=0.06),
    "motors at 70 %": lambda at, _: MotorDerating(begin_s=at, duration_s=20.0, thrust=0.7),
    "pilot takes over": lambda at, _: PilotSwitch(begin_s=at, mode=FlightMode.PILOT),
    "pilot holds": lambda at, _: PilotSwitch(begin_s=at, mode=FlightMode.HOLD),
    "pilot returns": lambda at, _: PilotSwitch(begin_s=at, mode=FlightMode.RETURN),
    "second ground station": lambda at, _: SecondStation(begin_s=at, duration_s=30.0, uploads=True),
    "arming refused for 10 s": lambda at, _: ArmingRefused(begin_s=at, duration_s=10.0),
    "heartbeat frozen, 10 s": lambda at, _: HeartbeatFrozen(begin_s=at, duration_s=10.0),
    "obstacle pushed": lambda at, _: ObstaclePushed(begin_s=at),
    "obstacle pushed while paused": lambda at, _: ObstaclePushed(begin_s=at, paused=True),
}

TOLD: dict[str, tuple[str, ...]] = {
    "link cut, 3 s": ("heard",),
    "link cut, 30 s": ("heard",),
    "link cut for good": ("never heard again",),
    "autopilot reboot": ("restarted", "disarmed"),
    "GPS loss, 15 s": ("ailsafe", "EKF", "position"),
    "battery critical": ("charge", "attery"),
    "pilot takes over": ("pilot",),
    "pilot holds": ("pilot",),
    "pilot returns": ("pilot",),
    "arming refused for 10 s": ("did not arm",),
    "heartbeat frozen, 10 s": ("heartbeat",),
}
"""Words of which the log has one after a fault that nobody may miss; the others may pass unnoticed."""
NOTICED_S = 20.0
"""A flight that ends sooner after its fault need not have noticed it."""


def _aside(rng: random.Random, size: float) -> tuple[float, float, float]:
    north, east = rng.gauss(0.0, 1.0), rng.gauss(0.0, 1.0)
    scale = size / max((north**2 + east**2) ** 0.5, 1e-9)
    return north * scale, east * scale, 0.0


@dataclasses.dataclass(frozen=True)
class Cell:
    """One flight of the matrix."""

    fault: str
    moment: str
    autopilot: Autopilot
    seed: int


def cells(seeds: int) -> Iterator[Cell]:
    """Every flight; a fault that only arming knows is flown at take-off alone."""
    for seed, fault, moment, autopilot in itertools.product(range(seeds), FAULTS, MOMENTS, Autopilot):
        if fault.startswith("arming") and moment != "take-off":
            continue
        yield Cell(fault, moment, autopilot, seed)


@functools.cache
def undisturbed(autopilot: Autopilot) -> Rehearsed:
    """A flight without faults: it tells when each phase comes."""
    return Rehearsal(autopilot).fly()


def begin_s(cell: Cell, rng: random.Random) -> float:
    """When the fault of a cell begins: some moment of the phase it belongs to."""
    entered = {phase: at for at, phase, _ in undisturbed(cell.autopilot).phases}
    match cell.moment:
        case "take-off" if cell.fault.startswith("arming"):
            # Ready, as it said, and yet it does not arm.
            return entered[Phase.ARMING] + 0.005
        case "take-off":
            # PX4 ends a take-off by holding: a pilot who holds in its last moments cannot be told from that.
            last_s = PX4_LEVELS_S if cell.fault == "pilot holds" and cell.autopilot is Autopilot.PX4 else 0.0
            return rng.uniform(entered[Phase.TAKING_OFF] + 0.2, entered[Phase.ENTERING] - last_s)
        case "follow":
            return rng.uniform(entered[Phase.FOLLOWING] + 2.0, entered[Phase.TURNING_BACK] - 3.0)
        case "replan":
            # Between asking and taking over.
            asked = entered[Phase.FOLLOWING] + REPLAN_EVERY_S * rng.randrange(1, 4)
            return asked + rng.uniform(0.0, REPLAN_TAKES_S)
        case "return":
            return rng.uniform(entered[Phase.RETURNING] + 0.2, entered[Phase.LANDING] - 1.0)
        case _:
            raise ValueError(f"no such moment: {cell.moment}")


def fly_cell(cell: Cell) -> tuple[Cell, str, tuple[str, ...]]:
    """Fly one cell.

    Returns:
        The cell, how it ended in a word or two, and what was broken.
    """
    rng = random.Random(f"{cell}")
    at_s = begin_s(cell, rng)
    fault = FAULTS[cell.fault](at_s, rng)
    flown = Rehearsal(cell.autopilot, (fault,), cell.seed).fly()
    broken = list(flown.faults)
    by_pilot = cell.fault.startswith("pilot")
    if flown.ended not in (*FINAL, Phase.OVERRIDDEN):
        broken.append(f"ended in {flown.ended.value}")
    if flown.left and not by_pilot:
        broken.append(f"{flown.left} after {flown.phases[-1][2]}")
    words = TOLD.get(cell.fault, ())
    told = [text for at, text in flown.said if at >= fault.begin_s]
    told += [why for at, _, why in flown.phases if at >= fault.begin_s]
    if words and flown.phases[-1][0] > at_s + NOTICED_S and not any(word in text for word in words for text in told):
        broken.append("nothing in the log tells of it")
    return cell, _word(flown), tuple(broken)


def _word(flown: Rehearsed) -> str:
    entered = [phase for _, phase, _ in flown.phases]
    if flown.ended is Phase.LANDED:
        if Phase.OVERRIDDEN in entered:
            return "landed by others"
        explored = any(why == "the exploration is done" for _, _, why in flown.phases)
        return "landed" if explored else "landed early"
    if flown.ended is Phase.ABORTED and "never heard again" not in flown.phases[-1][2]:
        return "not flown" if Phase.TAKING_OFF not in entered else "down"
    return {Phase.ABORTED: "lost", Phase.OVERRIDDEN: "taken over"}.get(flown.ended, flown.ended.value)
