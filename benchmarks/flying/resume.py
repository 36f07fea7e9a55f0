"""kill −9 at ten moments of a flight, then `mission resume`: what is covered in the end, and what was covered twice.

The vehicle of the second part is a fresh one at home, as after a battery swap. Everything that was really flown while
exploring, in all parts, is held against the flight that nobody interrupted.

python -m benchmarks.flying.resume [FLIGHTS]
"""

from __future__ import annotations

import dataclasses
import json
import random
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from jaxtyping import Float

from benchmarks.flying.processes import EXAMPLES, airborne_s, overrides, run_mission, start_mission
from benchmarks.timing import machine
from mission.flying.belief import INTERVAL_S, covered_by
from mission.flying.flight_folder import FlightFolder, read_flight_folder
from mission.flying.journal import explored_positions
from mission.flying.recorder import LOG_NAME
from planner.spectral_metric import mode_weights

MOMENTS = 10
UNDISTURBED = 2
SPEED = "5"
# Replans off: two flights with them differ by more than an interruption makes, as they depend on the host's time.
CHANGES = ("planner.duration_s=120", "replanning.enabled=false")
CELL_M = 10.0
_LOOK_HOST_S = 0.02
_LONGEST_HOST_S = 300.0


@dataclasses.dataclass(frozen=True)
class Covered:
    """What a flight came to, over all its parts.

    Attributes:
        ergodic_metric: Of every position of the exploration.
        explored_s: Time spent exploring.
        too_long: Share of that time spent in cells beyond what the information wants there.
        landed: Whether the last part landed by itself.
    """

    ergodic_metric: float
    explored_s: float
    too_long: float
    landed: bool


def covered(flight: FlightFolder) -> Covered:
    """Measure a flight on its log."""
    flown_m = explored_positions(flight.log)
    problem, modes = flight.problem, flight.options.modes
    residual = covered_by(flown_m, 1.0, problem, modes).mean_basis - problem.information.coefficients(modes)
    metric = float(np.sum(mode_weights(modes, flight.options.metric_weights) * residual**2))
    landed = bool(flight.summary and flight.summary["landed"])
    return Covered(metric, len(flown_m) * INTERVAL_S, too_long(flown_m, flight), landed)


def too_long(flown_m: Float[np.ndarray, "time 3"], flight: FlightFolder) -> float:
    """Share of the time that cells of the ground got beyond their share of the (uniform) information."""
    low, high = flight.problem.workspace.box_min_m[:2], flight.problem.workspace.box_max_m[:2]
    counts = np.ceil((high - low) / CELL_M).astype(int)
    spent, _, _ = np.histogram2d(
        flown_m[:, 0], flown_m[:, 1], bins=counts, range=[(low[0], high[0]), (low[1], high[1])]
    )
    spent /= max(spent.sum(), 1.0)
    return float(np.maximum(spent - 1.0 / spent.size, 0.0).sum())


def fly(folder: Path, changes: tuple[str, ...]) -> list[str]:
    """The command of an uninterrupted flight."""
    return ["fly", str(EXAMPLES / "forest.toml"), "--speed", SPEED, "--out", str(folder), *overrides(changes)]


def killed_at(folder: Path, moment_s: float, changes: tuple[str, ...]) -> None:
    """Fly, and kill the flight as its log reaches a moment of the flight clock."""
    process = start_mission(fly(folder, changes))
    until_s = time.monotonic() + _LONGEST_HOST_S
    armed_s, torn = None, ""
    while process.poll() is None and not (folder / LOG_NAME).exists():
        time.sleep(_LOOK_HOST_S)
    with (folder / LOG_NAME).open(encoding="utf-8") as log:
        while process.poll() is None and time.monotonic() < until_s:
            torn += log.readline()
            if not torn.endswith("\n"):
                time.sleep(_LOOK_HOST_S)
                continue
            record, torn = json.loads(torn), ""
            if record["kind"] == "telemetry" and record["armed"]:
                armed_s = record["t"] if armed_s is None else armed_s
                if record["t"] - armed_s >= moment_s:
                    break
    process.kill()
    process.wait()


def main() -> None:
    """Fly, kill, resume, and print the table."""
    moments = int(sys.argv[1]) if len(sys.argv) > 1 else MOMENTS
    print(f"{machine()}; forest, 120 s of exploration, --speed {SPEED}\n")
    chance = random.Random(0)
    with tempfile.TemporaryDirectory() as scratch:
        _table(Path(scratch), CHANGES, moments, chance)


def _table(scratch: Path, changes: tuple[str, ...], moments: int, chance: random.Random) -> None:
    whole = []
    duration_s = 0.0
    for index in range(UNDISTURBED):
        folder = scratch / f"whole-{index}"
        run_mission(fly(folder, changes))
        flight = read_flight_folder(folder)
        whole.append(covered(flight))
        began_s, ended_s = airborne_s(flight.log)
        duration_s = ended_s - began_s
    metric = float(np.median([flight.ergodic_metric for flight in whole]))
    spread = max(flight.ergodic_metric for flight in whole) / min(flight.ergodic_metric for flight in whole)
    print("| killed at | explored then | E of all parts | E over the uninterrupted | explored in all | beyond wanted |")
    print("|---|---|---|---|---|---|")
    undisturbed = np.median([[flight.explored_s, flight.too_long] for flight in whole], axis=0)
    print(f"| never | – | {metric:.5f} | 1 (spread {spread:.3f}) | {undisturbed[0]:.1f} s | {undisturbed[1]:.1%} |")
    parts: list[Covered] = []
    for index in range(moments):
        moment_s = duration_s * (index + chance.random()) / moments
        folder = scratch / f"killed-{index}"
        killed_at(folder, moment_s, changes)
        done_s = len(explored_positions(read_flight_folder(folder).log)) * INTERVAL_S
        run_mission(["resume", str(folder), "--speed", SPEED])
        part = covered(read_flight_folder(folder))
        parts.append(part)
        print(
            f"| {moment_s:.0f} s | {done_s:.1f} s | {part.ergodic_metric:.5f} | {part.ergodic_metric / metric:.3f} | "
            f"{part.explored_s:.1f} s | {part.too_long:.1%} |{'' if part.landed else ' not landed'}",
            flush=True,
        )
    ratios = [part.ergodic_metric / metric for part in parts]
    times = [part.explored_s for part in parts]
    beyond = [part.too_long for part in parts]
    for name, take in (("median", np.median), ("worst", np.max)):
        print(f"| {name} | | | {take(ratios):.3f} | {take(times):.1f} s | {take(beyond):.1%} |")


if __name__ == "__main__":
    main()
