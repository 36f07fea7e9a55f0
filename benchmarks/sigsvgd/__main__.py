"""Every experiment, one after the other."""

from benchmarks.sigsvgd import motion_planning, navigation, product_forest
from benchmarks.timing import machine

print(machine())
for experiment in (motion_planning, navigation, product_forest):
    experiment.main()
