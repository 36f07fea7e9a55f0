"""Forty-odd ways to get a mission file wrong: each is refused with exit code 2, the dotted path, and what to do."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from mission.cli import app

SITE = "site={origin={latitude_deg=47, longitude_deg=8, altitude_amsl_m=400}, "

# What is set, the path that must be named, and words that the advice must hold.
OVERRIDES = {
    "number in quotes": ("vehicle.max_speed_mps='8'", "vehicle.max_speed_mps", "number without quotes, in m/s"),
    "unit written out": ("planner.duration_s='10 min'", "planner.duration_s", "in seconds"),
    "whole number with a point": ("planner.seed=1.5", "planner.seed", "whole number"),
    "truth in quotes": ("replanning.enabled='yes'", "replanning.enabled", "true or false"),
    "text without quotes": ("link.address=5", "link.address", "text in quotes"),
    "not a number": ("planner.duration_s=nan", "planner.duration_s", "finite"),
    "infinite": ("site.box_max_enu_m=[500, 500, inf]", "site.box_max_enu_m.2", "finite"),
    "unknown entry": ("vehicle.max_speed_kmh=30", "vehicle.max_speed_kmh", "did you mean max_speed_mps"),
    "unknown section": ("plannner.seed=1", "plannner", "did you mean planner"),
    "unknown kind": ("obstacle.0.kind=spere", "obstacle.0.kind", "did you mean 'sphere'"),
    "kind missing": ("information={}", "information.kind", '"uniform"'),
    "entry of another kind": ("information.kind=uniform", "information.component", 'belongs to kind = "gaussians"'),
    "unknown choice": ("planner.kernel=makrov", "planner.kernel", "did you mean 'markov'"),
    "unknown preset": ("vehicle.preset=px4", "vehicle.preset", "px4-quadrotor"),
    "table instead of value": ("planner.seed={}", "planner.seed", "whole number"),
    "value instead of table": ("vehicle=3", "vehicle", "must be a table"),
    "value instead of tables": ("obstacle=3", "obstacle", "[[obstacle]]"),
    "two coordinates": ("planner.start_enu_m=[1, 2]", "planner.start_enu_m.2", "start_enu_m = [10, 10, 30]"),
    "four coordinates": ("planner.start_enu_m=[1, 2, 3, 4]", "planner.start_enu_m", "[10, 10, 30]"),
    "latitude and longitude exchanged": (
        "planner.end_enu_m={lla_deg_m=[8.5456, 47.3977, 520]}",
        "planner.end_enu_m",
        "are latitude and longitude exchanged",
    ),
    "latitude out of range": ("planner.end_enu_m={lla_deg_m=[97, 8, 520]}", "planner.end_enu_m", "within ±90"),
    "origin out of range": ("site.origin.latitude_deg=4739770", "site.origin.latitude_deg", "at most 89"),
    "millimetres": ("site.box_max_enu_m=[500000, 500000, 80000]", "site.box_max_enu_m.0", "at most 100000"),
    "negative radius": ("obstacle.0.radius_m=-2", "obstacle.0.radius_m", "at least 0.001, in metres"),
    "negative speed": ("vehicle.max_speed_mps=-8", "vehicle.max_speed_mps", "at least 0.01, in m/s"),
    "stream too slow for PX4": ("flight.stream_rate_hz=1", "flight.stream_rate_hz", "at least 4"),
    "seed beyond the last": ("planner.seed=99999999999", "planner.seed", "at most 2,147,483,647"),
    "folder instead of a file": ("information={kind='raster', raster='/', cell_m=1}", "information.raster", "a folder"),
    "no candidates": ("planner.candidates=0", "planner.candidates", "at least 1"),
    "modes that measure nothing": ("planner.modes=[1, 1, 1]", "planner.modes", "[8, 8, 4]"),
    "too many modes": ("planner.modes=[200, 200, 200]", "planner.modes", "fewer"),
    "fewer samples than are taken": ("planner.samples=8", "planner.samples", "at least 16"),
    "more samples than are taken": ("planner.samples=5000", "planner.samples", "at most 2,048"),
    "a time step of too few samples": ("planner.time_step_s=50", "planner.time_step_s", "write at most 37.5"),
    "a time step of too many samples": ("planner.time_step_s=0.1", "planner.time_step_s", "write at least 0.29"),
    "weights of a metric without": (
        "planner={start_enu_m=[9,9,30], duration_s=60, metric='kernel', metric_weights='squared'}",
        "planner.metric_weights",
        "leave it out",
    ),
    "samples given twice": (
        "planner={start_enu_m=[9,9,30], duration_s=60, samples=50, time_step_s=1}",
        "planner.time_step_s",
        "keep one of the two",
    ),
    "address of no kind": ("link.address=COM3", "link.address", "serial:///dev/ttyUSB0:57600"),
    "port beyond the last": ('link.address="udp://:99999"', "link.address", "udp://:14540"),
    "port of nothing": ('link.address="tcp://127.0.0.1:0"', "link.address", "tcp://127.0.0.1:5760"),
    "host with half a bracket": ('link.address="udp://[::1"', "link.address", "udp://:14540"),
    "rate of no serial line": ('link.address="serial:///dev/ttyUSB0:5"', "link.address", "57600"),
    "box upside down": ("site.box_max_enu_m=[500, 500, 10]", "site.box_max_enu_m", "greater than box_min_enu_m"),
    "box and polygon": ("site.polygon_enu_m=[[0,0],[9,0],[9,9]]", "site.box_min_enu_m", "either"),
    "no volume at all": (SITE + "floor_m=20}", "site.box_min_enu_m", "polygon_enu_m, floor_m and ceiling_m"),
    "fence that crosses itself": (
        SITE + "polygon_enu_m=[[0,0],[100,100],[100,0],[0,100]], floor_m=20, ceiling_m=80}",
        "site.polygon_enu_m",
        "in order",
    ),
    "fence without start": (
        SITE + "polygon_enu_m=[[100,100],[400,100],[400,400]], floor_m=20, ceiling_m=80}",
        "planner.start_enu_m",
        "outside",
    ),
    "cylinder upside down": ("obstacle.1.ceiling_m=-5", "obstacle.1.ceiling_m", "greater than floor_m"),
    "prism of two corners": (
        "obstacle.2={kind='prism', polygon_enu_m=[[0,0],[1,1]], floor_m=0, ceiling_m=5}",
        "obstacle.2.polygon_enu_m",
        "at least 3",
    ),
    "start outside the box": ("planner.start_enu_m=[10, 10, 95]", "planner.start_enu_m", "up must be 20 … 80"),
    "end outside the box": ("planner.end_enu_m=[-10, 10, 30]", "planner.end_enu_m", "east must be 0 … 500"),
    "start in an obstacle": ("planner.start_enu_m=[250, 255, 50]", "planner.start_enu_m", "inside obstacle.0"),
    "start too near an obstacle": ("planner.start_enu_m=[250, 270.5, 50]", "planner.start_enu_m", "1.4 m away"),
    "end in a no-fly volume": (
        "no_fly=[{kind='box', min_enu_m=[0,0,0], max_enu_m=[30,5,90]}, "
        "{kind='cylinder', center_enu_m=[20,10], radius_m=5, floor_m=0, ceiling_m=90}]",
        "planner.end_enu_m",
        "inside no_fly.1",
    ),
    "climb under an obstacle": (
        "obstacle=[{kind='box', min_enu_m=[5, 5, 10], max_enu_m=[15, 15, 15]}]",
        "site.home_enu_m",
        "the climb above it lies inside obstacle.0",
    ),
    "climb into an obstacle": ("site.home_enu_m=[400, 108, 0]", "site.home_enu_m", "obstacle.1"),
    "fence without home": ("site.home_enu_m=[-40, 10, 0]", "site.home_enu_m", "home lies outside the fence"),
    "fence without a rally point": ("site.rally_enu_m=[[9,9,30], [900,0,30]]", "site.rally_enu_m.1", "outside"),
    "rally point under an obstacle": ("site.rally_enu_m=[[9,9,30], [250,250,0]]", "site.rally_enu_m.1", "obstacle.0"),
    "rally point beside a tower": ("site.rally_enu_m=[[400,89,70]]", "site.rally_enu_m.0", "the descent to it"),
    "take-off above the ceiling": ("flight.takeoff_altitude_m=120", "flight.takeoff_altitude_m", "20 … 80"),
    "endurance too short": ("vehicle.endurance_s=600", "planner.duration_s", "write at most 461"),
    "endurance without hope": ("vehicle.endurance_s=20", "planner.duration_s", "not even without exploring"),
    "no time to reach the end": ("planner.duration_s=1", "planner.duration_s", "more than that"),
    "margins that leave no room": ("flight.clearance_margin_m=900", "flight.clearance_margin_m", "no information"),
    "information elsewhere": (
        "information.component.0.mean_enu_m=[9000, 9000, 40]",
        "information.component",
        "no information in the box",
    ),
    "detection without a sensor": ("belief.kind=detection", "sensor.detection_radius_m", "detection_radius_m = 33.0"),
    "missing file": ("information={kind='raster', raster='gone.npz', cell_m=1}", "information.raster", "no such file"),
    "override without a value": ("planner.seed", "--set", "--set section.entry=value"),
    "override through a value": ("planner.duration_s.x=1", "--set", "has no entry"),
    "override past the end of a list": ("obstacle.7.radius_m=1", "--set", "from 0 to 2"),
    "override of half a list": ("planner.modes=[8, 8", "--set", "not valid TOML"),
}

# A file of the raster's making, what is set, and words that the advice must hold.
RASTERS = {
    "empty": (np.zeros((0, 5)), "", "rows and columns"),
    "of zeros": (np.zeros((20, 20)), "", "zero everywhere inside the box"),
    "negative": (np.full((20, 20), -1.0), "", "negative"),
    "with NaN": (np.where(np.arange(20)[:, None] < 3, np.nan, np.ones(20)), "", "NaN"),
    "all NaN under an anchor": (np.full((20, 20), np.nan), ", anchor='peak'", "NaN"),
    "of three dimensions": (np.ones((5, 5, 5)), "", "rows and columns"),
    "of texts": (np.array([["a", "b"]]), "", "numbers are needed"),
    "somewhere else": (np.ones((20, 20)), ", center_enu_m=[9000, 0]", "does not touch the box"),
    "without a cell size": (np.ones((20, 20)), None, "cell_m = 30.0"),
}

# The text of a GeoJSON file, and words that the advice must hold.
RING = [[8.546, 47.398], [8.547, 47.398], [8.547, 47.399], [8.546, 47.398]]
GEOJSONS = {
    "not JSON": ("{", "is not JSON"),
    "no GeoJSON": ("{}", "FeatureCollection"),
    "no features": ('{"type": "FeatureCollection", "features": []}', "no polygons"),
    "a point": ({"geometry": {"type": "Point", "coordinates": [8, 47]}}, "feature 0: its geometry is a Point"),
    "no height": ({"properties": {}, "geometry": {"type": "Polygon", "coordinates": [RING]}}, "height_property"),
    "height as words": (
        {"properties": {"height_m": "tall"}, "geometry": {"type": "Polygon", "coordinates": [RING]}},
        "metres are needed",
    ),
    "height below its base": (
        {"properties": {"height_m": 3, "base_m": 5}, "geometry": {"type": "Polygon", "coordinates": [RING]}},
        "not above its base",
    ),
    "latitude and longitude exchanged": (
        {"properties": {"height_m": 3}, "geometry": {"type": "Polygon", "coordinates": [[c[::-1] for c in RING]]}},
        "are latitude and longitude exchanged",
    ),
    "another town": (
        {
            "properties": {"height_m": 3},
            "geometry": {"type": "Polygon", "coordinates": [[[x + 1, y] for x, y in RING]]},
        },
        "75 km from the mission",
    ),
    "metres instead of degrees": (
        {"properties": {"height_m": 3}, "geometry": {"type": "Polygon", "coordinates": [[[900, 900]] * 4]}},
        "not degrees",
    ),
}


def refused(arguments):
    """What `mission check` says of a mission it refuses: path → advice, and everything on stderr."""
    result = CliRunner().invoke(app, ["check", *map(str, arguments), "--json"])
    assert result.exit_code == 2, result.output
    assert result.exception is None or isinstance(result.exception, SystemExit)
    assert "Traceback" not in result.output
    document = json.loads(result.stdout)
    for finding in document["findings"]:
        assert finding["path"] in result.stderr
        assert len(finding["advice"]) > 10
    return {finding["path"]: finding["advice"] for finding in document["findings"]}


@pytest.mark.parametrize("fault", OVERRIDES)
def test_a_bad_entry_is_refused_with_its_path_and_what_to_write(fault, sound):
    override, path, words = OVERRIDES[fault]
    found = refused([sound, "--set", override])
    assert path in found
    assert words in found[path]


def test_a_sensor_that_looks_too_seldom_for_the_speed_is_refused():
    found = refused(["examples/search.toml", "--set", "sensor.rate_hz=0.2"])
    assert "every 50 m and sees no farther than 33 m" in found["sensor.rate_hz"]
    assert "at least 0.31" in found["sensor.rate_hz"]


def test_a_landing_into_an_obstacle_is_refused(sound):
    over_the_cylinder = ["--set", "planner.end_enu_m=[400, 100, 70]"]
    assert CliRunner().invoke(app, ["check", str(sound), *over_the_cylinder]).exit_code == 0
    found = refused([sound, *over_the_cylinder, "--set", "flight.end='land'"])
    assert "the landing below it lies inside obstacle.1" in found["planner.end_enu_m"]


@pytest.mark.parametrize("fault", RASTERS)
def test_a_bad_raster_is_refused(fault, sound, tmp_path):
    array, entries, words = RASTERS[fault]
    np.save(tmp_path / "map.npy", array)
    cell = "" if entries is None else ", cell_m=50"
    raster = f"information={{kind='raster', raster='{tmp_path / 'map.npy'}'{cell}{entries or ''}}}"
    found = refused([sound, "--set", raster])
    assert any(path.startswith("information.") and words in advice for path, advice in found.items())


def test_a_file_that_is_no_array_is_refused_without_advice_to_trust_it(sound, tmp_path):
    (tmp_path / "map.npy").write_text("hello")
    found = refused([sound, "--set", f"information={{kind='raster', raster='{tmp_path / 'map.npy'}', cell_m=9}}"])
    assert found["information.raster"].endswith("it is none, or holds objects instead of numbers")


@pytest.mark.parametrize("fault", GEOJSONS)
def test_bad_buildings_are_refused(fault, sound, tmp_path):
    document, words = GEOJSONS[fault]
    if isinstance(document, dict):
        features = [{"type": "Feature", **document}]
        document = json.dumps({"type": "FeatureCollection", "features": features})
    (tmp_path / "town.geojson").write_text(document)
    entry = f"obstacle=[{{kind='geojson', file='{tmp_path / 'town.geojson'}'}}]"
    assert words in refused([sound, "--set", entry])["obstacle.0.file"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("east_m,north_m\n1,2\n", "it needs east_m, north_m, up_m"),
        ("east_m,north_m,up_m\n1,2,x\n", "line 2"),
        ("east_m,north_m,up_m,weight\n1,2\n", "line 2: it has not as many entries"),
        ("east_m,north_m,up_m\n1,2,30,4\n", "line 2: it has not as many entries"),
        ("east_m,north_m,up_m\n", "no positions"),
        ("east_m,north_m,up_m,weight\n1,2,30,-1\n", "negative"),
        ("east_m,north_m,up_m\n-1,2,30\n", "lies in the box"),
        ("east_m,north_m,up_m\n1,nan,30\n", "row 1"),
    ],
)
def test_bad_samples_are_refused(content, words, sound, tmp_path):
    (tmp_path / "seen.csv").write_text(content)
    found = refused([sound, "--set", f"information={{kind='samples', samples='{tmp_path / 'seen.csv'}'}}"])
    assert words in found["information.samples"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"[site\n", "not valid TOML"),
        (b"\xff\xfe\x00", "UTF-8"),
        (b"planner.seed = 1\nplanner.seed = 2\n", "not valid TOML"),
    ],
)
def test_a_file_that_is_not_toml_is_refused(content, words, tmp_path):
    path = tmp_path / "bad.toml"
    path.write_bytes(content)
    assert words in refused([path])["file"]


def test_a_file_that_does_not_exist_is_refused(tmp_path):
    assert "No such file" in refused([tmp_path / "gone.toml"])["file"]


def test_an_empty_file_is_told_every_section_it_lacks(tmp_path):
    path = tmp_path / "empty.toml"
    path.write_text("")
    assert set(refused([path])) == {"site", "information", "planner"}


def test_forty_kinds_of_fault_are_known():
    assert len(OVERRIDES) + len(RASTERS) + len(GEOJSONS) >= 40


def test_a_missing_kind_is_one_fault_and_not_one_for_each_kind_there_is(sound):
    assert set(refused([sound, "--set", "obstacle.0={}"])) == {"obstacle.0.kind"}
