import pytest

SOUND = """
[site]
origin = { latitude_deg = 47.3977, longitude_deg = 8.5456, altitude_amsl_m = 488.0 }
box_min_enu_m = [0.0, 0.0, 20.0]
box_max_enu_m = [500.0, 500.0, 80.0]

[information]
kind = "gaussians"
[[information.component]]
mean_enu_m = [120.0, 300.0, 40.0]
std_m = [40.0, 60.0, 15.0]

[[obstacle]]
kind = "sphere"
center_enu_m = [250.0, 250.0, 50.0]
radius_m = 20.0

[[obstacle]]
kind = "cylinder"
center_enu_m = [400.0, 100.0]
radius_m = 10.0
floor_m = 0.0
ceiling_m = 60.0

[vehicle]
preset = "px4-quadrotor"

[planner]
start_enu_m = [10.0, 10.0, 30.0]
end_enu_m = [20.0, 10.0, 30.0]
duration_s = 600.0
"""


@pytest.fixture
def sound(tmp_path):
    """The path of a mission file without a fault."""
    path = tmp_path / "sound.toml"
    path.write_text(SOUND, encoding="utf-8")
    return path
