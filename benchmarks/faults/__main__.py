"""Print the fault matrix: every fault × phase × autopilot, some seeds each.

python -m benchmarks.faults [SEEDS] [FILE]

With a file every flight is kept there as it ends, and what the file holds is not flown again.
"""

from __future__ import annotations

import collections
import concurrent.futures
import json
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from benchmarks.faults.matrix import FAULTS, MOMENTS, Cell, cells, fly_cell
from sim_bridge.dialects import Autopilot

SEEDS = 20
Outcome = tuple[str, tuple[str, ...]]
"""How a flight ended in a word or two, and what was broken."""


def main() -> None:
    """Print the table, and what went wrong where something did."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS
    file = Path(sys.argv[2]) if len(sys.argv) > 2 else None
    outcomes = dict(_kept(file))
    left = [cell for cell in cells(seeds) if cell not in outcomes]
    began_s = time.monotonic()
    with concurrent.futures.ProcessPoolExecutor(max_workers=min(2, os.cpu_count() or 1)) as pool:
        for cell, word, broken in pool.map(fly_cell, left, chunksize=4):
            outcomes[cell] = (word, broken)
            _keep(file, cell, outcomes[cell])
    print_table(outcomes)
    wrong = [f"{cell_line(cell)}: {fault}" for cell, (_, broken) in outcomes.items() for fault in broken]
    print(f"\n{len(outcomes)} flights, {len(left)} of them now in {time.monotonic() - began_s:.0f} s; ", end="")
    print(f"{len(wrong)} broke something")
    for line in wrong[:40]:
        print("  " + line)
    if wrong:
        raise SystemExit(1)


def print_table(outcomes: dict[Cell, Outcome]) -> None:
    """A row a fault, a column a moment and an autopilot: how the flights ended."""
    counters: dict[tuple[str, str, Autopilot], collections.Counter[str]] = collections.defaultdict(collections.Counter)
    for cell, (word, _) in outcomes.items():
        counters[cell.fault, cell.moment, cell.autopilot][word] += 1
    columns = [(moment, autopilot) for autopilot in Autopilot for moment in MOMENTS]
    print("| fault | " + " | ".join(f"{autopilot.name.lower()}, {moment}" for moment, autopilot in columns) + " |")
    print("|" + "---|" * (len(columns) + 1))
    for fault in FAULTS:
        row = []
        for moment, autopilot in columns:
            counter = counters.get((fault, moment, autopilot))
            row.append(", ".join(f"{count} {name}" for name, count in counter.most_common()) if counter else "–")
        print(f"| {fault} | " + " | ".join(row) + " |")


def cell_line(cell: Cell) -> str:
    """A cell as one line."""
    return f"{cell.fault} while {cell.moment} on {cell.autopilot.name.lower()}, seed {cell.seed}"


def _kept(file: Path | None) -> Iterator[tuple[Cell, Outcome]]:
    if file is None or not file.exists():
        return
    for line in file.read_text(encoding="utf-8").splitlines():
        fault, moment, autopilot, seed, word, broken = json.loads(line)
        yield Cell(fault, moment, Autopilot[autopilot], seed), (word, tuple(broken))


def _keep(file: Path | None, cell: Cell, outcome: Outcome) -> None:
    if file is not None:
        with file.open("a", encoding="utf-8") as kept:
            kept.write(json.dumps([cell.fault, cell.moment, cell.autopilot.name, cell.seed, *outcome]) + "\n")


if __name__ == "__main__":
    main()
