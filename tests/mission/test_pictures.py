"""What pictures say, measured on the figures that are drawn."""

import dataclasses
import warnings

import numpy as np
import pytest
import shapely
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from mission.candidates import ranked_candidates
from mission.flying.flight_log import read_flight_log
from mission.flying.recorder import Recorder
from mission.flying.summary import summarize
from mission.loading import load
from mission.pictures import picture
from mission.pictures.candidates_picture import draw_candidates
from mission.pictures.flight_picture import draw_flight
from mission.pictures.ground_map import draw_ground, ground_entries
from mission.pictures.picture import draw_plan
from mission.pictures.series import draw_height_above_ground
from mission.pictures.style import distance, duration, plain
from mission.site.problem import problem_from_mission
from tests.mission.flying_vehicle import STATE

SITE = """
[site]
origin = { latitude_deg = 47.3977, longitude_deg = 8.5456, altitude_amsl_m = 488.0 }
box_min_enu_m = [0.0, 0.0, 20.0]
box_max_enu_m = [500.0, 500.0, 80.0]
[information]
kind = "uniform"
[vehicle]
[planner]
start_enu_m = [10.0, 10.0, 50.0]
duration_s = 60.0
"""


@pytest.fixture
def figures(monkeypatch):
    """The figures that are saved, in order."""
    saved = []
    save = Figure.savefig

    def keep(self, *args, **how):
        save(self, *args, **how)
        saved.append(self)

    monkeypatch.setattr(Figure, "savefig", keep)
    return saved


def titled(figure, title):
    (found,) = [axis for axis in figure.axes if axis.get_title(loc="left") == title]
    return found


def legend_of(figure):
    texts = [text for axis in figure.axes if axis.get_legend() for text in axis.get_legend().get_texts()]
    return [text.get_text() for text in texts + [text for found in figure.legends for text in found.get_texts()]]


def named(planned, name, overrides=None):
    mission = planned.mission.model_copy(update={"name": name, **(overrides or {})})
    return dataclasses.replace(planned, mission=mission)


def flight(folder, planned, on_course=True):
    """A flight along the plan at 8 m/s of a vehicle that may do so."""
    curve = planned.plan.best.trajectory
    recorder = Recorder(folder, {"name": planned.mission.name, "link": "sim", "mode": "offboard", "started": ""})
    recorder.course(0.0, recorder.keep(curve).result(), "plan")
    recorder.write("phase", 0.0, phase="taking off", why="armed")
    recorder.write("phase", 1.0, phase="exploring", why="at the start")
    for now in np.arange(1.0, curve.duration_s, 1.0):
        motion = curve.motion_at(curve.start_s + now)
        state = dataclasses.replace(
            STATE,
            time_s=now,
            position_enu_m=tuple(motion.position_m),
            velocity_enu_mps=(7.9, 0.0, 0.0),
            battery_fraction=0.9,
            home_enu_m=(10.0, 10.0, 0.0),
        )
        recorder.telemetry(now, state, "exploring", tuple(motion.position_m) if on_course else None)
    recorder.close()
    log = read_flight_log(folder)
    summary = summarize(log, planned.problem, planned.options, planned.mission.vehicle.max_speed_mps)
    draw_flight(log, planned.mission, planned.problem, summary, folder / "flight.png")


def test_names_of_limits_stand_beside_the_axes_and_hide_nothing_of_the_curve(planned, figures, tmp_path):
    draw_plan(planned, tmp_path / "plan.png")
    flight(tmp_path, planned)
    for figure in figures:
        for title in ("height above the origin [m]", "speed [m/s]", "clearance to obstacles [m]"):
            axis = titled(figure, title)
            assert axis.texts
            for text in axis.texts:
                assert text.get_window_extent().x0 >= axis.get_window_extent().x1
                assert text.get_window_extent().x1 <= figure.bbox.x1


def test_the_least_clearance_is_marked_and_is_the_one_that_the_gate_proved(planned, figures, tmp_path):
    draw_plan(planned, tmp_path / "plan.png")
    axis = titled(figures[0], "clearance to obstacles [m]")
    (mark,) = [line for line in axis.lines if line.get_marker() == "o"]
    least = planned.plan.best.report.min_clearance_m
    assert mark.get_ydata()[0] == pytest.approx(least, rel=0.01)
    said = f"● least {mark.get_ydata()[0]:.3g} m\nat {mark.get_xdata()[0]:.0f} s"
    assert said in [text.get_text() for text in axis.texts]


def test_plan_and_flight_show_clearance_on_the_same_axis(planned, figures, tmp_path):
    near = dataclasses.replace(planned.problem, clearance_margin_m=0.1)
    draw_plan(dataclasses.replace(planned, problem=near), tmp_path / "plan.png")
    flight(tmp_path, dataclasses.replace(planned, problem=near))
    assert [titled(figure, "clearance to obstacles [m]").get_yscale() for figure in figures] == ["log", "log"]


def test_the_box_and_the_fence_of_the_autopilot_are_both_drawn_and_named(planned, figures, tmp_path):
    site = planned.mission.site.model_copy(update={"fence_margin_m": 40.0})
    wide = named(planned, "Wide", {"site": site})
    draw_plan(wide, tmp_path / "plan.png")
    flight(tmp_path, wide)
    for figure in figures:
        assert {"box of the paths", "fence of the autopilot"} <= set(legend_of(figure))
        corners = [np.asarray(patch.get_path().vertices) for patch in figure.axes[0].patches]
        assert any(np.array_equal(np.ptp(found, axis=0), [580.0, 580.0]) for found in corners)
        assert figure.axes[0].get_xlim()[0] < -40.0


def test_a_fence_far_outside_is_named_and_leaves_the_map_its_size(planned, figures, tmp_path):
    site = planned.mission.site.model_copy(update={"fence_margin_m": 400.0})
    draw_plan(named(planned, "Far", {"site": site}), tmp_path / "plan.png")
    assert "fence, 400 m farther out" in legend_of(figures[0])
    assert figures[0].axes[0].get_xlim()[0] > -40.0


def test_the_legend_of_a_flight_explains_the_map_and_the_shading(planned, figures, tmp_path):
    wide = dataclasses.replace(planned.problem, clearance_margin_m=5.0)
    flight(tmp_path, dataclasses.replace(planned, problem=wide))
    wanted = {"information", "no-fly", "obstacle, can be flown over or under", "time not exploring"}
    assert wanted <= set(legend_of(figures[0]))
    assert f"kept clear, {wide.keep_out_m:.3g} m" in legend_of(figures[0])


@pytest.mark.parametrize(("ceiling_m", "label"), [(60, "obstacle, can be flown over"), (79, "obstacle, full height")])
def test_an_obstacle_is_flown_over_only_where_there_is_room_for_what_is_kept_clear(
    planned, figures, tmp_path, ceiling_m, label
):
    text = f"obstacle=[{{kind='box', min_enu_m=[300,300,0], max_enu_m=[320,320,{ceiling_m}]}}]"
    (tmp_path / "mission.toml").write_text(SITE, encoding="utf-8")
    mission = load(tmp_path / "mission.toml", [text])
    draw_plan(
        dataclasses.replace(planned, mission=mission, problem=problem_from_mission(mission)), tmp_path / "plan.png"
    )
    found = [entry for entry in legend_of(figures[0]) if entry.startswith("obstacle")]
    assert found == [label]


def test_a_flight_is_held_against_the_vehicles_limit_and_not_against_the_plans(planned, figures, tmp_path):
    flight(tmp_path, planned)
    axis = titled(figures[0], "speed [m/s]")
    assert {text.get_text() for text in axis.texts} == {"vehicle's limit\n8 m/s", "planned up to\n7.52 m/s"}
    assert axis.get_ylim()[1] > 8.0


def test_without_a_course_there_is_no_panel_of_the_distance_from_it(planned, figures, tmp_path):
    flight(tmp_path / "on", planned)
    flight(tmp_path / "off", planned, on_course=False)
    titles = [{axis.get_title(loc="left") for axis in figure.axes} for figure in figures]
    assert titles[0] - titles[1] == {"distance from the course [m]"}


def test_at_most_some_dozens_of_candidates_are_drawn_and_the_legend_says_so(planned, figures, tmp_path):
    refused, selected = planned.plan.candidates
    others = [dataclasses.replace(selected) for _ in range(498)]
    many = dataclasses.replace(planned.plan, candidates=(refused, selected, *others))
    draw_plan(dataclasses.replace(planned, plan=many), tmp_path / "plan.png")
    thin = [line for line in figures[0].axes[0].lines if line.get_linewidth() < 1.0 and len(line.get_xdata()) > 2]
    assert len(thin) == picture.MOST_OTHERS
    assert f"the best {picture.MOST_OTHERS} of 499 others" in legend_of(figures[0])
    draw_plan(planned, tmp_path / "few.png")
    assert "other candidates, refused dashed" in legend_of(figures[1])


def test_names_are_drawn_as_they_are_written_and_no_wider_than_the_picture(planned, figures, tmp_path):
    for name in ("costs $5, or $10", "搜索 🚁 search", "a very long name that goes on " * 20):
        renamed = named(planned, name)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            draw_plan(renamed, tmp_path / "plan.png")
            draw_candidates(renamed, ranked_candidates(renamed), tmp_path / "candidates.png")
            flight(tmp_path / str(len(name)), renamed)
    for figure in figures:
        assert max(text.get_window_extent().x1 for text in figure.texts) <= figure.bbox.x1
    assert figures[0].texts[0].get_text() == "costs $5, or $10"
    assert not figures[0].texts[0].get_parse_math()
    assert plain("搜索 🚁 search, Zürich") == "?? ? search, Zürich"


def test_the_candidates_picture_has_a_legend_and_counts_in_words(planned, figures, tmp_path):
    rows = ranked_candidates(planned)
    draw_candidates(planned, rows, tmp_path / "two.png")
    draw_candidates(planned, rows[:1], tmp_path / "one.png")
    assert [figure.texts[1].get_text() for figure in figures] == [
        "2 candidates, 1 passed the gate",
        "1 candidate, 1 passed the gate",
    ]
    assert {"start", "end", "information", "refused, where it breaks most"} <= set(legend_of(figures[0]))
    assert any("ergodic metric" in text.get_text() for text in figures[0].axes[0].texts)


def test_a_search_shows_what_its_sensor_sees_along_the_path(planned, figures, tmp_path):
    sensor = planned.mission.sensor.model_copy(update={"detection_radius_m": 20.0})
    belief = planned.mission.belief.model_copy(update={"kind": "detection"})
    search = named(planned, "Search", {"sensor": sensor, "belief": belief})
    draw_plan(search, tmp_path / "plan.png")
    flight(tmp_path, search)
    curve = planned.plan.best.trajectory
    path = curve.sample(np.linspace(curve.start_s, curve.end_s, 2000)).position_m[:, :2]
    wanted = shapely.LineString(path).buffer(20.0).bounds
    for figure in figures:
        assert "seen by the sensor, 20 m each side" in legend_of(figure)
        swath = [patch for patch in figure.axes[0].patches if patch.get_zorder() == 1.5]
        low = np.min([patch.get_path().vertices.min(axis=0) for patch in swath], axis=0)
        high = np.max([patch.get_path().vertices.max(axis=0) for patch in swath], axis=0)
        np.testing.assert_allclose([*low, *high], wanted, atol=1.5)


def test_over_terrain_the_height_above_the_ground_is_drawn_between_its_two_limits(tmp_path):
    np.savez(tmp_path / "heights.npz", dem=np.tile(np.linspace(0.0, 20.0, 30), (30, 1)))
    (tmp_path / "mission.toml").write_text(
        SITE + "[[obstacle]]\nkind = 'terrain'\nfile = 'heights.npz'\ncell_m = 20.0\nheights = 'above-origin'\n"
        "center_enu_m = [250.0, 250.0]\nleast_height_m = 30.0\ngreatest_height_m = 60.0\n",
        encoding="utf-8",
    )
    problem = problem_from_mission(load(tmp_path / "mission.toml"))
    axis = Figure().add_subplot()
    position = np.stack([np.linspace(0.0, 500.0, 50), np.full(50, 250.0), np.full(50, 50.0)], axis=-1)
    draw_height_above_ground(axis, np.arange(50.0), position, problem)
    assert {text.get_text() for text in axis.texts} == {"least 30 m", "greatest 60 m"}
    height = axis.lines[0].get_ydata()
    ground = problem.obstacles.surfaces[0].height_at(position[:, :2])
    np.testing.assert_allclose(np.asarray(height), 50.0 - ground)
    assert axis.get_ylim()[1] < 100.0


def test_where_the_box_is_tall_colours_and_a_view_from_the_side_tell_heights(planned, figures, tmp_path):
    draw_plan(planned, tmp_path / "flat.png")
    narrow = dataclasses.replace(planned.problem.workspace, box_max_m=np.array([500.0, 500.0, 400.0]))
    tall = dataclasses.replace(planned.problem, workspace=narrow)
    draw_plan(dataclasses.replace(planned, problem=tall), tmp_path / "tall.png")
    flight(tmp_path, dataclasses.replace(planned, problem=tall))
    coloured = [[LineCollection in map(type, axis.collections) for axis in figure.axes[:2]] for figure in figures]
    assert coloured == [[False, False], [True, True], [True, True]]


@pytest.mark.parametrize(
    ("said", "wanted"),
    [
        (distance(6.5), "6.5 m"),
        (distance(7800.0), "7.80 km"),
        (duration(13.0), "13.0 s"),
        (duration(961.0), "16 min 1 s"),
        (duration(179.9), "3 min 0 s"),
    ],
)
def test_distances_and_times_are_said_in_units_of_their_size(said, wanted):
    assert said == wanted


def test_the_map_of_a_search_shows_where_the_target_may_be_and_not_the_effort(tmp_path):
    component = "[[information.component]]\nmean_enu_m = [250, 250, 50]\nstd_m = [60, 60, 20]"
    search = SITE.replace('kind = "uniform"', f'kind = "gaussians"\n{component}')
    search += "[sensor]\ndetection_radius_m = 20.0\n[belief]\nkind = 'detection'\n"
    (tmp_path / "mission.toml").write_text(search, encoding="utf-8")
    mission = load(tmp_path / "mission.toml")
    problem = problem_from_mission(mission)
    assert problem.search is not None
    axis = Figure().add_subplot()
    draw_ground(axis, mission, problem)
    np.testing.assert_allclose(np.asarray(axis.images[0].get_array()), problem.search.prior.mass.sum(axis=2).T)
    assert "where the target may be" in [entry.get_label() for entry in ground_entries(mission, problem)]


def test_of_a_search_the_pictures_say_what_is_found_and_not_the_ergodic_metric(planned, figures, tmp_path):
    candidates = tuple(dataclasses.replace(one, probability_found=0.456) for one in planned.plan.candidates)
    plan = dataclasses.replace(planned.plan, candidates=candidates, lawnmower_probability_found=0.24)
    search = dataclasses.replace(planned, plan=plan)
    draw_plan(search, tmp_path / "plan.png")
    draw_candidates(search, ranked_candidates(search), tmp_path / "candidates.png")
    assert "finds with probability 0.46, a lawnmower of its length with 0.24" in figures[0].texts[1].get_text()
    said = [text.get_text() for figure in figures for axis in figure.axes for text in axis.texts]
    assert "finds with" in said
    assert any(text.startswith("finds with probability 0.456\n") for text in said)
    assert not any("ergodic" in text for text in said)
