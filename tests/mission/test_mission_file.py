import json
import typing

import numpy as np
import pymap3d
import pytest
from pydantic import TypeAdapter

from mission.findings import InputError
from mission.loading import Document, load, mission_from_document, read_document
from mission.mission_file import Mission
from mission.mission_file.errors import sections_in
from mission.mission_file.planner import Planner
from mission.mission_file.values import Context
from mission.mission_file.vehicle import PRESETS, PresetName
from mission.resolved import Source, resolved_entries
from mission.site.buildings import read_buildings
from mission.site.problem import problem_from_mission
from mission.site.solids import frame_of
from planner.problem import Kernel, Method, Metric, MetricWeights

ORIGIN = (47.3977, 8.5456, 488.0)


def test_a_sound_file_becomes_a_mission_with_every_default_filled_in(sound):
    mission = load(sound)
    assert mission.name == "sound"
    assert mission.vehicle.max_speed_mps == PRESETS["px4-quadrotor"]["max_speed_mps"]
    assert mission.flight.clearance_margin_m == 1.0
    assert mission.home_enu_m == (10.0, 10.0, 0.0)
    assert mission.takeoff_altitude_m == 30.0
    assert mission.information.component[0].weight == 1.0


def test_modes_that_are_not_given_resolve_what_there_is_to_resolve(sound):
    assert load(sound).modes == (8, 8, 4)
    assert load(sound, ["planner.modes=[5, 6, 7]"]).modes == (5, 6, 7)
    # A search sees the ground alone, in swaths of 66 m over 1.5 km.
    searching = load("examples/search.toml").planner.model_copy(update={"modes": None})
    assert load("examples/search.toml").model_copy(update={"planner": searching}).modes == (32, 32, 1)


def test_an_explicit_figure_wins_over_the_presets(sound):
    mission = load(sound, ["vehicle.max_climb_mps=1.25"])
    assert mission.vehicle.max_climb_mps == 1.25
    assert mission.vehicle.max_descent_mps == PRESETS["px4-quadrotor"]["max_descent_mps"]


def test_every_preset_has_every_figure():
    assert set(PRESETS) == set(typing.get_args(PresetName))
    for name in PRESETS:
        assert set(PRESETS[name]) - {"max_turn_rate_degps"} == set(PRESETS["px4-quadrotor"])


def test_presets_have_the_figures_of_their_vehicles():
    px4, crazyflie = PRESETS["px4-quadrotor"], PRESETS["crazyflie"]
    # A vehicle is planned for within what its autopilot allows: 12 m/s, 3 m/s up, 1.5 m/s down, 5 m/s², 45 °/s.
    allowed = {"max_speed_mps": 12, "max_climb_mps": 3, "max_descent_mps": 1.5, "max_acceleration_mps2": 5}
    allowed["max_yaw_rate_degps"] = 60
    assert all(px4[name] <= most for name, most in allowed.items())
    assert (crazyflie["max_speed_mps"], crazyflie["max_acceleration_mps2"]) == (0.5, 2.0)


@pytest.mark.parametrize("turn", [1, -1])
def test_buildings_may_be_drawn_either_way_round(sound, tmp_path, turn):
    ring = [[8.5466, 47.3987], [8.5468, 47.3987], [8.5468, 47.3989], [8.5466, 47.3989], [8.5466, 47.3987]][::turn]
    feature = {
        "type": "Feature",
        "properties": {"height_m": 12.0},
        "geometry": {"type": "Polygon", "coordinates": [ring]},
    }
    town = tmp_path / "town.geojson"
    town.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    mission = load(sound, [f"obstacle=[{{kind='geojson', file='{town}'}}]"])
    (building,) = read_buildings(mission.obstacle[0], frame_of(mission))
    expected = np.stack(pymap3d.geodetic2enu(*np.array(ring[:-1])[:, ::-1].T, ORIGIN[2], *ORIGIN)[:2], axis=-1)
    assert {tuple(corner) for corner in building.polygon_m.round(3)} == {tuple(corner) for corner in expected.round(3)}
    problem_from_mission(mission)


@pytest.mark.parametrize(
    "spelling",
    [
        "planner.end_enu_m={ lla_deg_m = [47.3987, 8.5466, 528.0] }",
        "planner.end_lla_deg_m=[47.3987, 8.5466, 528.0]",
    ],
)
def test_a_geodetic_position_may_stand_wherever_metres_are_wanted(sound, spelling):
    text = sound.read_text().replace("end_enu_m = [20.0, 10.0, 30.0]\n", "")
    sound.write_text(text)
    expected = pymap3d.geodetic2enu(47.3987, 8.5466, 528.0, *ORIGIN)
    np.testing.assert_allclose(load(sound, [spelling]).planner.end_enu_m, expected, atol=1e-6)


def test_a_table_that_wants_one_position_takes_lla_deg_m_alone(sound):
    mission = load(sound, ["obstacle.0={kind='sphere', lla_deg_m=[47.3987, 8.5466, 528.0], radius_m=5}"])
    expected = pymap3d.geodetic2enu(47.3987, 8.5466, 528.0, *ORIGIN)
    np.testing.assert_allclose(mission.obstacle[0].center_enu_m, expected, atol=1e-6)


def test_a_polygon_may_be_geodetic(sound):
    corners = [[47.3977, 8.5456], [47.3977, 8.5506], [47.4007, 8.5506], [47.4007, 8.5456]]
    prism = f"{{kind='prism', polygon_lla_deg_m={corners}, floor_m=60, ceiling_m=70}}"
    polygon = np.array(load(sound, [f"obstacle.2={prism}"]).obstacle[2].polygon_enu_m)
    expected = np.stack(pymap3d.geodetic2enu(*np.array(corners).T, ORIGIN[2], *ORIGIN)[:2], axis=-1)
    np.testing.assert_allclose(polygon, expected, atol=1e-6)


def test_a_fenced_site_is_explored_in_the_box_around_its_polygon(sound):
    site = (
        "site={origin={latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=400.0}, "
        "polygon_enu_m=[[0,0],[300,-20],[200,400]], floor_m=20, ceiling_m=60}"
    )
    mission = load(sound, [site, "obstacle=[]", "planner.end_enu_m=[30,30,30]", "planner.start_enu_m=[30,20,30]"])
    assert mission.site.box_m == ((0.0, -20.0, 20.0), (300.0, 400.0, 60.0))


def test_overrides_reach_lists_append_to_them_and_take_bare_texts(sound):
    mission = load(
        sound,
        [
            "obstacle.0.radius_m=3",
            "obstacle.2={kind='box', min_enu_m=[1,100,0], max_enu_m=[9,110,30]}",
            "planner.kernel=rbf",
            "name=A name with spaces",
        ],
    )
    assert mission.obstacle[0].radius_m == 3.0
    assert mission.obstacle[2].kind == "box"
    assert mission.planner.kernel == "rbf"
    assert mission.name == "A name with spaces"


def test_file_names_start_at_the_mission_file_and_those_of_overrides_at_the_working_directory(
    sound, tmp_path, monkeypatch
):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    np.save(tmp_path / "map.npy", np.ones((20, 20)))
    np.save(elsewhere / "map.npy", np.full((20, 20), 2.0))
    head, _, tail = sound.read_text().partition("[information]")
    raster = (
        '[information]\nkind = "raster"\nraster = "map.npy"\ncell_m = 50.0\ncenter_enu_m = [250, 250]\n\n[[obstacle]]'
    )
    sound.write_text(head + raster + tail.partition("[[obstacle]]")[2])
    monkeypatch.chdir(elsewhere)
    assert load(sound).information.raster == tmp_path / "map.npy"
    assert load(sound, ["information.raster=map.npy"]).information.raster == elsewhere / "map.npy"


def test_every_fault_is_said_at_once_with_its_path(sound):
    overrides = [
        "planner.kernel=rbbf",
        "vehicle.max_speed_kmh=30",
        "obstacle.1.radius_m=-1",
        "site.box_max_enu_m=[500, nan, 80]",
        "flight.stream_rate_hz='20 Hz'",
        "informatoin.kind=uniform",
    ]
    with pytest.raises(InputError) as caught:
        load(sound, overrides)
    said = {finding.path: finding.advice for finding in caught.value.findings}
    assert set(said) == {
        "planner.kernel",
        "vehicle.max_speed_kmh",
        "obstacle.1.radius_m",
        "site.box_max_enu_m.1",
        "flight.stream_rate_hz",
        "informatoin",
    }
    assert "did you mean max_speed_mps (m/s)" in said["vehicle.max_speed_kmh"]
    assert "did you mean information" in said["informatoin"]


def test_a_fault_in_one_section_does_not_hide_what_does_not_fit_between_others(sound):
    with pytest.raises(InputError) as caught:
        load(sound, ["replanning.period_s=-1", "planner.start_enu_m=[250, 250, 50]", "planner.duration_s=1100"])
    assert {finding.path for finding in caught.value.findings} == {
        "replanning.period_s",
        "planner.start_enu_m",
        "planner.duration_s",
    }


def test_a_resolved_mission_written_out_is_the_same_mission_when_read_back(sound, tmp_path):
    mission = load(sound, ["obstacle.2={kind='box', min_enu_m=[1,100,0], max_enu_m=[9,110,30]}"])
    data = json.loads(json.dumps(mission.model_dump(mode="json", exclude_none=True)))
    again = mission_from_document(Document("plan.json", tmp_path, data))
    assert again == mission


def test_the_resolved_mission_says_where_each_value_comes_from_and_its_unit(sound):
    document = read_document(sound, ["planner.seed=4"])
    entries = {entry.path: entry for entry in resolved_entries(mission_from_document(document), document)}
    assert entries["planner.seed"].source is Source.COMMAND_LINE
    assert entries["planner.duration_s"].source is Source.FILE
    assert entries["planner.duration_s"].unit == "seconds"
    assert entries["vehicle.max_climb_mps"].source is Source.PRESET
    assert entries["flight.clearance_margin_m"].source is Source.DEFAULT
    assert entries["flight.takeoff_altitude_m"].source is Source.DERIVED
    assert entries["flight.takeoff_altitude_m"].value == 30.0


@pytest.mark.parametrize(
    ("entry", "enumeration"),
    [("kernel", Kernel), ("metric", Metric), ("metric_weights", MetricWeights), ("method", Method)],
)
def test_the_choices_of_the_file_are_those_of_the_planner(entry, enumeration):
    assert set(typing.get_args(Planner.model_fields[entry].annotation)) == {member.value for member in enumeration}


def tables_of(section):
    yield section
    for field in section.model_fields.values():
        for inner in sections_in(field.annotation):
            yield from tables_of(inner)


def test_what_the_advice_tells_people_to_write_is_accepted(tmp_path):
    shown = 0
    for table in set(tables_of(Mission)):
        annotations = typing.get_type_hints(table, include_extras=True)
        for name, field in table.model_fields.items():
            for example in field.examples or ():
                if isinstance(example, str):
                    (tmp_path / example.replace("/", "_")).touch()
                accepted = TypeAdapter(annotations[name]).validate_python(example, context=Context(tmp_path, None))
                assert accepted is not None
                shown += 1
    assert shown > 30


def test_a_closed_tour_ends_where_it_starts(sound):
    start = list(load(sound).planner.start_enu_m)
    problem = problem_from_mission(load(sound, ["planner.closed_tour=true", f"planner.end_enu_m={start}"]))
    np.testing.assert_array_equal(problem.end_position_m, problem.start.position_m)
    with pytest.raises(InputError, match="keep one of the two"):
        load(sound, ["planner.closed_tour=true", "planner.end_enu_m=[50.0, 50.0, 40.0]"])


def test_jerk_and_length_are_limited_where_they_are_given(sound):
    free = problem_from_mission(load(sound))
    assert free.limits.max_jerk_mps3 == free.max_length_m == np.inf
    bound = problem_from_mission(load(sound, ["vehicle.max_jerk_mps3=4.0", "planner.max_length_m=900.0"]))
    assert (bound.limits.max_jerk_mps3, bound.max_length_m) == (4.0, 900.0)
