"""Whether the battery lasts: for the ways there and home as they are flown, around what stands there."""

import numpy as np
import pytest

from mission.findings import InputError
from mission.loading import load
from mission.site.endurance import endurance_budget

FAR = ("planner.start_enu_m=[50, 250, 50]", "site.home_enu_m=[50, 250, 0]", "planner.end_enu_m=[450, 250, 50]")
WALL = "obstacle=[{kind='box', min_enu_m=[240, -10, -10], max_enu_m=[260, 430, 90]}]"


def test_the_way_home_leads_around_what_stands_in_it(sound):
    straight, around = (endurance_budget(load(sound, [*FAR, what])) for what in ("obstacle=[]", WALL))
    speed_mps = 0.94 * load(sound).vehicle.max_speed_mps
    assert straight.return_s == pytest.approx(400.0 / speed_mps, rel=0.2)
    # Past the end of the wall and back.
    shortest_m = 2.0 * np.hypot(190.0, 180.0) + 20.0
    assert around.return_s > shortest_m / speed_mps
    assert around.return_s < 1.5 * shortest_m / speed_mps + 10.0
    assert around.approach_s == straight.approach_s


def test_ways_are_reckoned_at_the_speed_that_is_flown_and_not_at_the_vehicle_s_greatest(sound):
    fast, slow = (
        endurance_budget(load(sound, [*FAR, "obstacle=[]", f"vehicle.speed_reserve={share}"])) for share in (0.0, 0.4)
    )
    assert slow.climb_s == pytest.approx(fast.climb_s / 0.6)
    # The last ten metres are landed slowly by any vehicle.
    assert slow.descent_s - 20.0 == pytest.approx((fast.descent_s - 20.0) / 0.6)
    assert slow.return_s > 1.5 * fast.return_s


def test_a_climb_on_the_way_takes_the_time_that_climbing_takes(sound):
    high = ("planner.start_enu_m=[60, 250, 75]", "site.home_enu_m=[50, 250, 0]", "flight.takeoff_altitude_m=25")
    budget = endurance_budget(load(sound, ["obstacle=[]", *high]))
    assert budget.approach_s >= 50.0 / load(sound).vehicle.max_climb_mps


def test_a_mission_whose_way_home_around_a_wall_is_too_long_is_refused(sound):
    with_wall = endurance_budget(load(sound, [*FAR, WALL]))
    enough = f"vehicle.endurance_s={np.ceil(with_wall.needed_s / 0.8):.0f}"
    assert load(sound, [*FAR, WALL, enough])
    without = endurance_budget(load(sound, [*FAR, "obstacle=[]"]))
    reserve = load(sound).flight.reserve_fraction
    tight = 0.5 * (with_wall.needed_s - with_wall.reserve_s + without.needed_s - without.reserve_s) / (1.0 - reserve)
    assert load(sound, [*FAR, "obstacle=[]", f"vehicle.endurance_s={tight:.1f}"])
    with pytest.raises(InputError, match="way home"):
        load(sound, [*FAR, WALL, f"vehicle.endurance_s={tight:.1f}"])


def test_a_file_that_cannot_be_read_hides_nothing_that_is_wrong_with_the_endurance(sound, tmp_path):
    (tmp_path / "bad.npy").write_text("nothing")
    broken = f"obstacle=[{{kind='points', file='{tmp_path / 'bad.npy'}', radius_m=1.0}}]"
    with pytest.raises(InputError) as refused:
        load(sound, [*FAR, broken, "vehicle.endurance_s=60"])
    paths = {finding.path for finding in refused.value.findings}
    assert {"planner.duration_s", "obstacle.0.file"} <= paths
