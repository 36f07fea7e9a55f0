"""Print the fault matrix: every fault × phase × autopilot, some seeds each.

python -m benchmarks.faults [SEEDS]
"""

from __future__ import annotations

import collections
import concurrent.futures
import os
import sys
import time

from benchmarks.faults.matrix import FAULTS, MOMENTS, Cell, cells, fly_cell
from sim_bridge.link_autopilot import Autopilot

SEEDS = 20


def main() -> None:
    """Print the table, and what went wrong where something did."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS
    began_s = time.monotonic()
    outcomes: dict[tuple[str, str, Autopilot], collections.Counter[str]] = collections.defaultdict(collections.Counter)
    wrong: list[str] = []
    with concurrent.futures.ProcessPoolExecutor(max_workers=min(2, os.cpu_count() or 1)) as pool:
        for cell, outcome, faults in pool.map(fly_cell, cells(seeds), chunksize=4):
            outcomes[cell.fault, cell.moment, cell.autopilot][outcome] += 1
            wrong += [f"{cell}: {fault}" for fault in faults]
    print_table(outcomes)
    flights = sum(sum(counter.values()) for counter in outcomes.values())
    print(f"\n{flights} flights in {time.monotonic() - began_s:.0f} s; {len(wrong)} broke something")
    for line in wrong[:40]:
        print("  " + line)
    if wrong:
        raise SystemExit(1)


def print_table(outcomes: dict[tuple[str, str, Autopilot], collections.Counter[str]]) -> None:
    """A row a fault, a column a moment and an autopilot: how the flights ended."""
    columns = [(moment, autopilot) for autopilot in Autopilot for moment in MOMENTS]
    print("| fault | " + " | ".join(f"{autopilot.name.lower()}, {moment}" for moment, autopilot in columns) + " |")
    print("|" + "---|" * (len(columns) + 1))
    for fault in FAULTS:
        row = []
        for moment, autopilot in columns:
            counter = outcomes.get((fault, moment, autopilot))
            row.append(", ".join(f"{count} {name}" for name, count in counter.most_common()) if counter else "–")
        print(f"| {fault} | " + " | ".join(row) + " |")


def cell_line(cell: Cell) -> str:
    """A cell as one line."""
    return f"{cell.fault} while {cell.moment} on {cell.autopilot.name.lower()}, seed {cell.seed}"


if __name__ == "__main__":
    main()
