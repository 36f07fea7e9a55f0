import numpy as np
import pytest

from mission.loading import load
from mission.planning import Planned
from mission.site.problem import options_from_mission, problem_from_mission
from planner import gate
from planner.diversity import Diversity
from planner.plan import Candidate, Plan, Status
from planner.trajectory import Trajectory

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


def rounded(corners, segments=60, duration_s=600.0):
    """A spline at rest at both ends that cuts the corners of a polyline."""
    corners = np.array(corners, dtype=float)
    places = np.linspace(0.0, len(corners) - 1.0, segments - 1)
    between = np.stack([np.interp(places, np.arange(len(corners)), axis) for axis in corners.T], axis=-1)
    control = np.vstack([between[:1], between[:1], between, between[-1:], between[-1:]])
    return Trajectory(control, duration_s / (len(control) - 3))


@pytest.fixture(scope="session")
def planned(tmp_path_factory):
    """A plan of two candidates made by hand: one around the obstacles, one through them."""
    path = tmp_path_factory.mktemp("planned") / "two ways.toml"
    no_fly = "\n[[no_fly]]\nkind = 'cylinder'\ncenter_enu_m = [100, 450]\nradius_m = 20\nfloor_m = 0\nceiling_m = 90\n"
    path.write_text(SOUND + no_fly, encoding="utf-8")
    mission = load(path, ["site.rally_enu_m=[[40, 40, 30]]"])
    problem, options = problem_from_mission(mission), options_from_mission(mission)
    around = rounded([[10, 10, 30], [450, 30, 60], [470, 470, 40], [200, 400, 70], [60, 200, 30], [20, 10, 30]])
    through = rounded([[10, 10, 30], [250, 250, 50], [480, 480, 50], [20, 10, 30]])
    candidates = (
        Candidate(through, "random", 0.01, 0.01, gate.inspect(through, problem)),
        Candidate(gate.prove(around, problem), "spiral", 0.02, 0.02),
    )
    assert [candidate.feasible for candidate in candidates] == [False, True]
    plan = Plan(Status.CONVERGED, candidates, 1, 0.05, Diversity(0.5, 0.3, 1.0, 2.0), 100)
    return Planned(mission, problem, options, plan, solve_s=0.5, total_s=0.6)


@pytest.fixture(scope="session")
def plan_file(planned):
    """The same plan as its file."""
    from mission.plan_output import plan_file_of

    return plan_file_of(planned)
