"""Time of a step over the number of candidates.

Taken: T = 100, K = 10², RBF. The paper's figures are from an RTX 3080; ours are from whatever this runs on.

python -m benchmarks.sves.figure_10_candidates [--most N]
"""

from __future__ import annotations

import argparse

import jax
import matplotlib.pyplot as plt
import numpy as np

from benchmarks.sves.report import print_claims, save
from benchmarks.sves.step_times import step_ms
from benchmarks.timing import machine
from planner.workspace import Workspace

MODES = (10, 10, 1)


def main() -> None:
    """Print and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    on_host = jax.default_backend() == "cpu"
    parser.add_argument("--most", type=int, default=256 if on_host else 4096, help="largest N")
    most = parser.parse_args().most
    counts = [4**power for power in range(7) if 4**power <= most]
    box = Workspace(np.zeros(3), np.ones(3))
    together = 20
    times = [step_ms(box, count, 100, MODES, repeats=7, together=together) for count in counts]
    print(machine())
    listed = ", ".join(f"N = {count}: {1e3 * time:.0f} µs" for count, time in zip(counts, times, strict=True))
    flat = times[-1] / times[0]
    print_claims(
        10,
        "time of a step over N",
        [
            (
                "57–66 µs a step on an RTX 3080, flat in N",
                listed,
                f"{flat:.1f}× from N = {counts[0]} to {counts[-1]}"
                + (": on a processor the work is what counts, and grows with N" if on_host else ""),
            )
        ],
    )
    figure, axis = plt.subplots(figsize=(4.2, 3.0))
    axis.loglog(counts, 1e3 * np.array(times), marker="o")
    axis.axhspan(57.0, 66.0, color="0.85", label="paper, RTX 3080")
    axis.set(xlabel="candidates N", ylabel="µs a step", title="T = 100, K = 10²")
    axis.legend(fontsize=8)
    save(figure, "figure_10_candidates")


if __name__ == "__main__":
    main()
