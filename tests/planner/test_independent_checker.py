"""The checker of plans: it confirms what the gate proved, and nothing that was changed afterwards."""

import copy
import dataclasses
import itertools
import json

import numpy as np
import pytest

from planner.gate import prove
from planner.obstacles import Box, Cylinder, ObstacleField, Prism, Sphere
from planner.seeds import seed_paths, spline_from_path
from planner.trajectory import Trajectory
from planner.yaw import headings
from tests.planner.independent_checker import check, hermite, main
from tests.planner.worlds import LIMITS, open_box

FENCE = [[-1.0, -1.0], [101.0, -1.0], [101.0, 81.0], [-1.0, 81.0]]
CORNERS = [[60.0, 50.0], [70.0, 50.0], [70.0, 60.0], [65.0, 53.0], [60.0, 60.0]]
ENTRIES = [
    {"kind": "sphere", "center_enu_m": [30.0, 40.0, 10.0], "radius_m": 6.0},
    {"kind": "cylinder", "center_enu_m": [70.0, 25.0], "radius_m": 5.0, "floor_m": 0.0, "ceiling_m": 25.0},
    {"kind": "box", "min_enu_m": [40.0, 10.0, 0.0], "max_enu_m": [50.0, 20.0, 30.0]},
    {"kind": "prism", "polygon_enu_m": CORNERS, "floor_m": 0.0, "ceiling_m": 30.0},
]


@pytest.fixture(scope="module")
def proven() -> tuple[dict, float]:
    """A plan.json as the mission writes it, of a path that the gate passed, and its proven clearance."""
    obstacles = ObstacleField.of(
        [
            Sphere(np.array([30.0, 40.0, 10.0]), 6.0),
            Cylinder(np.array([70.0, 25.0]), 5.0, 0.0, 25.0),
            Box(np.array([40.0, 10.0, 0.0]), np.array([50.0, 20.0, 30.0])),
            Prism(np.array(CORNERS), 0.0, 30.0),
        ]
    )
    careful = open_box(
        obstacles=obstacles, clearance_margin_m=2.0, limits=dataclasses.replace(LIMITS, max_acceleration_mps2=2.0)
    )
    seed = seed_paths(careful, 1, np.random.default_rng(0))[0]
    curve = Trajectory(spline_from_path(seed.points_m, careful, 400), careful.duration_s / 400)
    problem = open_box(obstacles=obstacles, fence_polygon_m=np.array(FENCE))
    report = prove(curve, problem).report
    samples = curve.sampled_every(0.05)
    yaw = headings(samples.time_s, samples.velocity_mps, LIMITS.max_yaw_rate_radps)
    vehicle = dataclasses.asdict(LIMITS)
    plan = {
        "origin": {"latitude_deg": 47.4, "longitude_deg": 8.5, "altitude_amsl_m": 488.0},
        "trajectory": {
            "time_s": samples.time_s.tolist(),
            "position_enu_m": samples.position_m.tolist(),
            "velocity_enu_mps": samples.velocity_mps.tolist(),
            "acceleration_enu_mps2": samples.acceleration_mps2.tolist(),
            "yaw_enu_rad": yaw.tolist(),
        },
        "spline": {
            "control_points_enu_m": curve.control_points_m.tolist(),
            "knot_interval_s": curve.knot_interval_s,
            "start_s": curve.start_s,
        },
        "limits": {
            **vehicle,
            "clearance_margin_m": 1.0,
            "vehicle_radius_m": 0.4,
            "box_min_enu_m": [0.0, 0.0, 0.0],
            "box_max_enu_m": [100.0, 80.0, 20.0],
            "fence_polygon_enu_m": FENCE,
        },
        "problem": {
            "mission": {
                "site": {"box_min_enu_m": [0.0, 0.0, 0.0], "box_max_enu_m": [100.0, 80.0, 20.0]},
                "obstacle": ENTRIES,
                "vehicle": {**vehicle, "radius_m": 0.4},
                "flight": {"clearance_margin_m": 1.0},
                "planner": {
                    "start_enu_m": problem.start.position_m.tolist(),
                    "end_enu_m": [95.0, 40.0, 10.0],
                    "duration_s": 200.0,
                },
            }
        },
    }
    return plan, report.min_clearance_m


def test_it_confirms_what_the_gate_proved_and_measures_the_same(proven) -> None:
    plan, clearance_m = proven
    found = check(plan)
    assert found.faults == ()
    assert clearance_m - 1e-4 <= found.min_clearance_m <= clearance_m + 2e-3
    assert found.max_speed_mps <= LIMITS.max_speed_mps


def moved(plan: dict, key: str, change) -> None:
    """Changes one array of the samples in place."""
    plan["trajectory"][key] = change(np.array(plan["trajectory"][key])).tolist()


def shifted_into(plan: dict, by: list[float]) -> None:
    moved(plan, "position_enu_m", lambda x: x + np.array(by))


def faster(plan: dict) -> None:
    moved(plan, "time_s", lambda t: t / 1.6)
    moved(plan, "velocity_enu_mps", lambda v: v * 1.6)
    moved(plan, "acceleration_enu_mps2", lambda a: a * 1.6**2)


def teleported(plan: dict) -> None:
    def jump(x: np.ndarray) -> np.ndarray:
        x[len(x) // 2] += [0.0, 0.05, 0.0]
        return x

    moved(plan, "position_enu_m", jump)


def mirrored(plan: dict) -> None:
    for key in ("position_enu_m", "velocity_enu_mps", "acceleration_enu_mps2"):
        moved(plan, key, lambda x: x[:, [1, 0, 2]])


def stretched(plan: dict) -> None:
    """The same path a tenth larger, everything consistent."""
    for key in ("position_enu_m", "velocity_enu_mps", "acceleration_enu_mps2"):
        moved(plan, key, lambda x: x * 1.1)


def bent(plan: dict) -> None:
    """Another spline in the file than the one that is streamed."""
    plan["spline"]["control_points_enu_m"][200][1] += 0.01


def cut_short(plan: dict) -> None:
    for key in plan["trajectory"]:
        plan["trajectory"][key] = plan["trajectory"][key][: -len(plan["trajectory"][key]) // 10]


def spun(plan: dict) -> None:
    moved(plan, "yaw_enu_rad", lambda yaw: np.where(np.arange(len(yaw)) > 100, yaw + np.pi, yaw))


def with_a_needle_on_the_path(plan: dict) -> None:
    east, north, _ = plan["trajectory"]["position_enu_m"][1234]
    plan["problem"]["mission"]["no_fly"] = [
        {"kind": "cylinder", "center_enu_m": [east, north + 1.3], "radius_m": 0.01, "floor_m": 0.0, "ceiling_m": 99.0}
    ]


def lost(plan: dict) -> None:
    plan["trajectory"]["position_enu_m"][77][1] = float("nan")


def relaxed(plan: dict) -> None:
    """The plan's own limits loosened, so that a faster flight would seem to keep them."""
    for name in ("max_speed_mps", "max_climb_mps", "max_descent_mps", "max_acceleration_mps2"):
        plan["limits"][name] *= 5.0
    faster(plan)


def set_in(plan: dict, *path: str, value: object) -> None:
    for step in path[:-1]:
        plan = plan[step]
    plan[path[-1]] = value


@pytest.mark.parametrize(
    ("mutate", "says"),
    [
        (lambda plan: shifted_into(plan, [0.0, 6.0, 0.0]), "clearance|box|begins"),
        (lambda plan: shifted_into(plan, [0.0, 0.0, 0.01]), "begins 0.0100 m from start"),
        (stretched, "box|begins"),
        (mirrored, "begins|ends|clearance|box"),
        (faster, "exceeds"),
        (relaxed, "exceeds"),
        (teleported, "positions are up to 0.05"),
        (lambda plan: moved(plan, "velocity_enu_mps", lambda v: v * 1.01), "from where the velocities lead"),
        (lambda plan: moved(plan, "acceleration_enu_mps2", lambda a: a * 0.5), "accelerations make"),
        (lambda plan: moved(plan, "velocity_enu_mps", lambda v: v[:-1]), "do not belong together"),
        (lambda plan: moved(plan, "time_s", lambda t: t[::-1]), "time does not increase"),
        (lost, "not finite"),
        (cut_short, "ends"),
        (spun, "turns at"),
        (bent, "off the spline in the file"),
        (with_a_needle_on_the_path, "clearance"),
        (lambda plan: set_in(plan, "problem", "mission", "flight", "clearance_margin_m", value=9.0), "clearance"),
        (lambda plan: set_in(plan, "problem", "mission", "vehicle", "radius_m", value=8.0), "clearance"),
        (lambda plan: set_in(plan, "problem", "mission", "vehicle", "max_descent_mps", value=1e-3), "descent"),
        (lambda plan: set_in(plan, "problem", "mission", "planner", "duration_s", value=150.0), "takes 200"),
        (lambda plan: set_in(plan, "problem", "mission", "planner", "end_enu_m", value=[9.0, 9.0, 9.0]), "ends"),
        (lambda plan: set_in(plan, "problem", "mission", "site", "polygon_enu_m", value=FENCE[:3]), "fence"),
    ],
)
def test_a_plan_that_was_changed_is_not_confirmed(proven, mutate, says: str) -> None:
    plan = copy.deepcopy(proven[0])
    mutate(plan)
    faults = check(plan).faults
    assert faults
    assert any(part in "; ".join(faults) for part in says.split("|")), faults


def test_quintics_pass_through_the_samples_and_are_exact_for_quintics() -> None:
    power = np.random.default_rng(0).normal(size=(6, 3))
    time = np.array([0.0, 0.4, 1.0, 1.1])
    terms = [np.stack([np.polyval(np.polyder(c[::-1], order), time) for c in power.T], axis=1) for order in range(3)]
    fine = hermite(time, *terms, 10)
    dense = np.concatenate([np.linspace(a, b, 11) for a, b in itertools.pairwise(time)])
    for order, found in enumerate(fine):
        expected = np.stack([np.polyval(np.polyder(c[::-1], order), dense) for c in power.T], axis=1)
        np.testing.assert_allclose(found, expected, atol=1e-9)


def test_run_by_hand_it_says_what_it_found(proven, tmp_path, capsys) -> None:
    good, bad = tmp_path / "plan.json", tmp_path / "changed.json"
    good.write_text(json.dumps(proven[0]), encoding="utf-8")
    changed = copy.deepcopy(proven[0])
    spun(changed)
    bad.write_text(json.dumps(changed), encoding="utf-8")
    assert main([str(good)]) == 0
    assert "confirmed" in capsys.readouterr().out
    assert main([str(good), str(bad)]) == 1
    assert "turns at" in capsys.readouterr().out
    assert main([]) == 1


def test_an_obstacle_it_does_not_know_is_not_passed_over(proven) -> None:
    plan = copy.deepcopy(proven[0])
    plan["problem"]["mission"]["obstacle"].append({"kind": "mesh", "file": "tower.stl"})
    with pytest.raises(ValueError, match="mesh"):
        check(plan)
