"""Makes hill_heights.npz: the ground of hill.toml, two hills and some roughness, metres above the origin.

python examples/make_hill_heights.py
"""

from pathlib import Path

import numpy as np

CELL_M = 10.0
LOW_M, HIGH_M = (-50.0, -50.0), (650.0, 550.0)
WAVES = 8


def main() -> None:
    """Write the file: rows run from north to south."""
    rng = np.random.default_rng(4)
    east, north = np.meshgrid(
        *(np.arange(low, high + 1.0, CELL_M) for low, high in zip(LOW_M, HIGH_M, strict=True)), indexing="ij"
    )
    height = 8.0 + 0.02 * east
    for top_m, middle, width in ((18.0, (180.0, 330.0), (70.0, 55.0)), (60.0, (420.0, 180.0), (110.0, 90.0))):
        away = ((east - middle[0]) / width[0]) ** 2 + ((north - middle[1]) / width[1]) ** 2
        height += top_m * np.exp(-0.5 * away)
    for _ in range(WAVES):
        heading, wave_m = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(90.0, 260.0)
        along = east * np.cos(heading) + north * np.sin(heading)
        height += rng.uniform(0.4, 1.6) * np.sin(2.0 * np.pi * along / wave_m + rng.uniform(0.0, 6.3))
    rows = height.T[::-1].round(1).astype(np.float32)
    np.savez_compressed(Path(__file__).with_name("hill_heights.npz"), height_m=rows)


if __name__ == "__main__":
    main()
