import csv
import io
import json
import math
import socket
import xml.etree.ElementTree as ET

import numpy as np
import pymap3d
import pytest
import shapely
from pymavlink.dialects.v20 import common as mavlink

from mission.exports import Format, exported
from mission.mission_items import Command, mission_items

KML = "{http://www.opengis.net/kml/2.2}"


def enu(plan, latitude, longitude, altitude):
    origin = plan.origin
    return np.stack(
        pymap3d.geodetic2enu(
            np.asarray(latitude, dtype=float),
            np.asarray(longitude, dtype=float),
            np.asarray(altitude, dtype=float),
            origin.latitude_deg,
            origin.longitude_deg,
            origin.altitude_amsl_m,
        ),
        axis=-1,
    )


@pytest.fixture(scope="module")
def importer():
    """mavsdk's mission importer; it wants a vehicle, and a heartbeat is vehicle enough."""
    from mavsdk import ComponentType, Configuration, Mavsdk
    from mavsdk.plugins.mission_raw import MissionRaw

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    client = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    client.add_any_connection(f"udpin://127.0.0.1:{port}")
    vehicle = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    beat = vehicle.heartbeat_encode(mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_PX4, 0, 0, 4).pack(vehicle)
    system = None
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        while system is None:
            sender.sendto(beat, ("127.0.0.1", port))
            system = client.first_autopilot(0.2)
    yield MissionRaw(system)
    client.destroy()


def same_item(read, item):
    """Whether an imported item means what was written."""
    params = [0.0 if p is None else p for p in item.params]
    got = [0.0 if math.isnan(p) else p for p in (read.param1, read.param2, read.param3, read.param4)]
    place = (read.x / 1e7, read.y / 1e7, read.z)
    return (
        read.command == item.command
        and read.frame == item.frame
        and np.allclose(got, params, atol=1e-4)
        and np.allclose(place, (item.latitude_deg, item.longitude_deg, item.altitude_m), atol=1e-3, rtol=0.0)
        and abs(place[0] - item.latitude_deg) < 1.1e-7
        and abs(place[1] - item.longitude_deg) < 1.1e-7
    )


def test_mavsdk_reads_the_qgroundcontrol_plan_back_item_by_item(importer, plan_file):
    read = importer.import_qgroundcontrol_mission_from_string(exported(plan_file, Format.QGC))
    items = mission_items(plan_file)
    assert len(read.mission_items) == len(items)
    assert all(map(same_item, read.mission_items, items))


def test_mavsdk_reads_the_fence_and_the_rally_points_back(importer, plan_file):
    read = importer.import_qgroundcontrol_mission_from_string(exported(plan_file, Format.QGC))
    inclusion = [item for item in read.geofence_items if item.command == 5001]
    exclusion = [item for item in read.geofence_items if item.command == 5002]
    assert [item.param1 for item in inclusion] == [4.0] * 4
    corners = enu(plan_file, [i.x / 1e7 for i in inclusion], [i.y / 1e7 for i in inclusion], 488.0)[:, :2]
    np.testing.assert_allclose(corners, plan_file.flight.fence_enu_m, atol=0.02)
    assert len(exclusion) == len(plan_file.flight.no_fly[0].polygon_enu_m)
    assert len(read.rally_items) == 1
    rally = read.rally_items[0]
    np.testing.assert_allclose(enu(plan_file, rally.x / 1e7, rally.y / 1e7, 518.0), [40, 40, 30], atol=0.05)
    assert rally.frame == 3
    assert rally.z == pytest.approx(30.0, abs=1e-3)


def test_mavsdk_reads_the_waypoint_list_back_item_by_item(importer, plan_file):
    read = importer.import_mission_planner_mission_from_string(exported(plan_file, Format.WPL)).mission_items
    items = mission_items(plan_file)
    # The importer may or may not keep item 0, which is home.
    read = read[len(read) - len(items) :]
    assert len(read) == len(items)
    assert all(map(same_item, read, items))


def test_the_items_take_off_first_fly_every_waypoint_at_its_speed_and_end_as_asked(plan_file):
    items = mission_items(plan_file)
    assert items[0].command is Command.TAKEOFF
    assert items[-1].command is Command.RETURN_TO_LAUNCH
    flown = [item for item in items if item.command is Command.WAYPOINT]
    # An estimate that wanders by 0.8 m may never come nearer.
    assert min(item.params[1] for item in flown) >= 1.0
    home_amsl_m = json.loads(exported(plan_file, Format.QGC))["mission"]["plannedHomePosition"][2]
    columns = ([i.latitude_deg for i in flown], [i.longitude_deg for i in flown])
    places = enu(plan_file, *columns, [i.altitude_m + home_amsl_m for i in flown])
    np.testing.assert_allclose(places, [waypoint.position_enu_m for waypoint in plan_file.waypoints], atol=1e-6)
    speed, speeds = math.nan, []
    for item in items:
        if item.command is Command.CHANGE_SPEED:
            speed = item.params[1]
        elif item.command is Command.WAYPOINT:
            speeds.append(speed)
    np.testing.assert_allclose(speeds, [max(w.speed_mps, 0.2) for w in plan_file.waypoints], rtol=0.12, atol=0.01)
    assert max(speeds) <= plan_file.limits.max_speed_mps


def test_a_flight_that_lands_where_it_ends_ends_with_landing_there(plan_file):
    landing = plan_file.model_copy(update={"flight": plan_file.flight.model_copy(update={"end": "land"})})
    item = mission_items(landing)[-1]
    assert item.command is Command.LAND
    place = enu(plan_file, item.latitude_deg, item.longitude_deg, 488.0)
    np.testing.assert_allclose(place[:2], plan_file.waypoints[-1].position_enu_m[:2], atol=0.01)


def test_a_plan_of_more_items_than_ardupilot_holds_is_refused_with_what_to_do(plan_file):
    flight = plan_file.flight.model_copy(update={"autopilot": "ardupilot"})
    long = plan_file.model_copy(update={"flight": flight, "waypoints": plan_file.waypoints * 40})
    with pytest.raises(ValueError, match="ArduPilot holds 650"):
        mission_items(long)


def test_the_qgroundcontrol_plan_has_every_part_it_must(plan_file):
    document = json.loads(exported(plan_file, Format.QGC))
    assert (document["fileType"], document["version"], document["groundStation"]) == ("Plan", 1, "QGroundControl")
    mission = document["mission"]
    assert (mission["firmwareType"], mission["vehicleType"]) == (12, 2)
    assert mission["cruiseSpeed"] == mission["hoverSpeed"] == plan_file.limits.max_speed_mps
    copter = plan_file.model_copy(update={"flight": plan_file.flight.model_copy(update={"autopilot": "ardupilot"})})
    assert json.loads(exported(copter, Format.QGC))["mission"]["firmwareType"] == 3
    assert {document[part]["version"] for part in ("mission", "geoFence", "rallyPoints")} == {2}
    home = document["mission"]["plannedHomePosition"]
    np.testing.assert_allclose(enu(plan_file, *home), plan_file.flight.home_enu_m, atol=1e-6)
    for number, item in enumerate(document["mission"]["items"], start=1):
        assert (item["type"], item["doJumpId"], item["autoContinue"]) == ("SimpleItem", number, True)
        assert len(item["params"]) == 7
        assert all(p is None or math.isfinite(p) for p in item["params"])
        if "Altitude" in item:
            east, north, _ = enu(plan_file, *item["params"][4:])
            assert abs(east) < 2000.0
            assert abs(north) < 2000.0
        assert len({"AltitudeMode", "Altitude", "AMSLAltAboveTerrain"} & set(item)) in (0, 3)


def test_the_waypoint_list_has_home_first_and_numbers_in_every_column(plan_file):
    lines = exported(plan_file, Format.WPL).splitlines()
    assert lines[0] == "QGC WPL 110"
    rows = [line.split("\t") for line in lines[1:]]
    assert [int(row[0]) for row in rows] == list(range(len(rows)))
    assert all(len(row) == 12 for row in rows)
    assert all(math.isfinite(float(cell)) for row in rows for cell in row)
    assert [row[1] for row in rows] == ["1"] + ["0"] * (len(rows) - 1)
    home = [float(cell) for cell in rows[0][8:11]]
    np.testing.assert_allclose(enu(plan_file, *home), plan_file.flight.home_enu_m, atol=1e-3)


def test_the_table_is_the_trajectory_in_both_frames(plan_file):
    rows = list(csv.DictReader(io.StringIO(exported(plan_file, Format.CSV))))
    flown = plan_file.trajectory
    local = np.array([[float(row[name]) for name in ("east_m", "north_m", "up_m")] for row in rows])
    np.testing.assert_allclose(local, flown.position_enu_m, atol=1e-4)
    geodetic = [[float(row[name]) for row in rows] for name in ("latitude_deg", "longitude_deg", "altitude_amsl_m")]
    np.testing.assert_allclose(enu(plan_file, *geodetic), local, atol=2e-4)
    np.testing.assert_allclose([float(row["yaw_enu_rad"]) for row in rows], flown.yaw_enu_rad, atol=1e-5)


def test_shapely_reads_the_geojson_and_finds_the_path_inside_the_fence(plan_file):
    document = json.loads(exported(plan_file, Format.GEOJSON))
    shapes = shapely.from_geojson(json.dumps(document))
    assert shapes.is_valid.all() if isinstance(shapes, np.ndarray) else shapes.is_valid
    by_role = {}
    for feature in document["features"]:
        geometry = shapely.geometry.shape(feature["geometry"])
        by_role.setdefault(feature["properties"]["role"], []).append(geometry)
    path, fence = by_role["path"][0], by_role["fence"][0]
    assert fence.exterior.is_ccw
    assert fence.covers(path)
    assert len(by_role["waypoint"]) == len(plan_file.waypoints)
    assert len(by_role["candidate"]) == len(plan_file.candidates) - 1
    longitude, latitude, altitude = np.array(path.coords).T
    wanted = [waypoint.position_enu_m for waypoint in plan_file.waypoints]
    np.testing.assert_allclose(enu(plan_file, latitude, longitude, altitude), wanted, atol=2e-3)


def test_the_kml_path_is_absolute_with_longitude_first(plan_file):
    root = ET.fromstring(exported(plan_file, Format.KML))
    assert root.tag == f"{KML}kml"
    marks = {mark.findtext(f"{KML}name"): mark for mark in root.iter(f"{KML}Placemark")}
    line = marks["Path"].find(f"{KML}LineString")
    assert {mode.text for mode in root.iter(f"{KML}altitudeMode")} == {"absolute"}
    triples = np.array([[float(n) for n in place.split(",")] for place in line.findtext(f"{KML}coordinates").split()])
    wanted = [waypoint.position_enu_m for waypoint in plan_file.waypoints]
    np.testing.assert_allclose(enu(plan_file, triples[:, 1], triples[:, 0], triples[:, 2]), wanted, atol=2e-3)
    assert {"Start", "End", "Home", "Fence", "Candidate 0"} <= set(marks)


@pytest.mark.parametrize("format", Format)
def test_an_export_is_the_same_whenever_it_is_made(format, plan_file):
    assert exported(plan_file, format) == exported(plan_file.model_copy(deep=True), format)


def test_of_hundreds_of_candidates_maps_hold_the_best_and_say_so(plan_file):
    ranked = [
        candidate.model_copy(update={"cost": 1.0 + k}) for k, candidate in enumerate(plan_file.candidates[1:] * 99)
    ]
    refused = plan_file.candidates[0].model_copy(update={"ergodic_metric": None, "cost": None})
    many = plan_file.model_copy(update={"candidates": [refused, *reversed(ranked)], "selected": 99})
    features = json.loads(exported(many, Format.GEOJSON))["features"]
    assert features[0]["properties"]["candidates"] == 100
    numbers = [f["properties"]["number"] for f in features if f["properties"]["role"] == "candidate"]
    # The cheapest come last in this set; the refused one does not.
    assert numbers == list(range(51, 99))
    markup = exported(many, Format.KML)
    assert "Other candidates (the best 48 of 99)" in markup
    assert markup.count("<name>Candidate ") == 48
    few = plan_file.model_copy(update={"candidates": [refused, plan_file.candidates[1]]})
    assert "ergodic metric not finite" in exported(few, Format.KML)
