"""Random worlds, each planned, gated, and confirmed by a checker that shares no code with the planner.

python -m benchmarks.worlds [COUNT [FIRST_SEED [PROCESSES]]]
"""

from __future__ import annotations

import multiprocessing
import sys
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from benchmarks.timing import machine
from benchmarks.worlds.drawn import CLASSES
from benchmarks.worlds.outcome import Outcome, tried
from mission.planning import keep_compiled

COUNT = 1000


def row(name: str, outcomes: list[Outcome]) -> str:
    """A line of the table."""
    simple = [outcome for outcome in outcomes if outcome.simple]
    around = [outcome for outcome in outcomes if outcome.around]
    candidates = sum(outcome.candidates for outcome in outcomes)
    return (
        f"| {name} | {len(outcomes)} | {sum(o.straight for o in outcomes)} | {sum(o.rows for o in outcomes)} "
        f"| {sum(o.planned for o in simple)}/{len(simple)} | {sum(o.planned for o in around)}/{len(around)} "
        f"| {sum(o.planned for o in outcomes)} | {sum(o.passed for o in outcomes)}/{candidates} "
        f"| {sum(o.checked for o in outcomes)} | {sum(bool(o.unsound) for o in outcomes)} "
        f"| {np.median([o.warm_s for o in outcomes]):.2f} s |"
    )


def tell(outcomes: list[Outcome]) -> None:
    """A line where the last world has no plan or an unsound one, and now and then how far it is."""
    last = outcomes[-1]
    if not last.planned or last.unsound:
        known = "a simple tour" if last.simple else "a way around" if last.around else "nothing"
        what = "; ".join([last.why, *last.unsound])
        print(f"{last.seed} {last.kind}: {known} is known to be feasible; {what}", flush=True)
    if len(outcomes) % 20 == 0:
        planned, warm_s = sum(one.planned for one in outcomes), np.median([one.warm_s for one in outcomes])
        print(f"after {len(outcomes)}: {planned} planned, {warm_s:.2f} s each", file=sys.stderr, flush=True)


def main() -> None:
    """Print the worlds without a plan or with an unsound one, then the table; Ctrl-C: of those that were tried."""
    given = [int(text) for text in sys.argv[1:]]
    count, first, processes = (*given, *(COUNT, 0, 1)[len(given) :])
    print(machine())
    outcomes: list[Outcome] = []
    context = multiprocessing.get_context("spawn")
    # A class stays with one process, which alone compiles it.
    pools = [ProcessPoolExecutor(1, context, initializer=keep_compiled) for _ in range(processes)]
    pending = [pools[seed % len(CLASSES) % processes].submit(tried, seed) for seed in range(first, first + count)]
    try:
        for future in pending:
            outcomes.append(future.result())
            tell(outcomes)
    except KeyboardInterrupt:
        outcomes += [future.result() for future in pending[len(outcomes) :] if future.done()]
    for pool in pools:
        pool.shutdown(cancel_futures=True)
    print(
        "\n| worlds | number | line feasible | lawnmower feasible | planned, where either is "
        "| planned, where a way around is | planned | candidates passed | curves checked | unsound | warm |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for name, keep in (
        ("flat", lambda o: o.kind.flat),
        ("three-dimensional", lambda o: not o.kind.flat),
        ("to 20 m", lambda o: o.width_m <= 20.0),
        ("20 to 200 m", lambda o: 20.0 < o.width_m <= 200.0),
        ("over 200 m", lambda o: o.width_m > 200.0),
        ("more than 20 obstacles", lambda o: o.obstacles > 20),
        ("rough ground", lambda o: o.kind.rough),
        ("all", lambda o: True),
    ):
        chosen = [outcome for outcome in outcomes if keep(outcome)]
        if chosen:
            print(row(name, chosen))


if __name__ == "__main__":
    main()
