"""Every claim, one after the other."""

import sys

from benchmarks.kes import control, cost, coverage, examples, parameter, poses

for part in (cost, parameter, coverage, poses, control, examples):
    part.main()
    sys.stdout.flush()
