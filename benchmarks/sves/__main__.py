"""Every figure, one after the other."""

from benchmarks.sves import (
    figure_02_strategies,
    figure_03_determinant,
    figure_04_forest,
    figure_05_cube,
    figure_06_adaptation,
    figure_09_kernels,
    figure_10_candidates,
    figure_11_horizon,
    figure_12_aircraft,
)

for figure in (
    figure_02_strategies,
    figure_03_determinant,
    figure_04_forest,
    figure_05_cube,
    figure_06_adaptation,
    figure_09_kernels,
    figure_10_candidates,
    figure_11_horizon,
    figure_12_aircraft,
):
    figure.main()
