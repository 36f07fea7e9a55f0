"""KML 2.2 for Google Earth and its kin: longitude, latitude and absolute altitude."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence

from mission.exports.geojson import lon_lat_alt, others_of
from mission.plan_file import PlanFile, Vector
from sim_bridge.state import GeodeticPoint

NAMESPACE = "http://www.opengis.net/kml/2.2"

STYLES = {"path": ("ff0066ff", "4"), "candidate": ("80999999", "1"), "fence": ("ff33aa33", "2")}
"""Colour (alpha, blue, green, red) and width of each kind of line."""


def _coordinates(positions: Sequence[Vector], origin: GeodeticPoint) -> str:
    return " ".join(",".join(f"{number:.10g}" for number in place) for place in lon_lat_alt(positions, origin))


def _placemark(parent: ET.Element, name: str, description: str, style: str | None) -> ET.Element:
    placemark = ET.SubElement(parent, "Placemark")
    ET.SubElement(placemark, "name").text = name
    ET.SubElement(placemark, "description").text = description
    if style:
        ET.SubElement(placemark, "styleUrl").text = f"#{style}"
    return placemark


def _geometry(placemark: ET.Element, kind: str, coordinates: str) -> None:
    geometry = ET.SubElement(placemark, kind)
    ET.SubElement(geometry, "altitudeMode").text = "absolute"
    ET.SubElement(geometry, "coordinates").text = coordinates


def keyhole_markup(plan: PlanFile) -> str:
    """The selected path, the best other candidates, start, end, home and the fence."""
    origin = plan.origin.point()
    root = ET.Element("kml", xmlns=NAMESPACE)
    document = ET.SubElement(root, "Document")
    ET.SubElement(document, "name").text = plan.name
    for name, (color, width) in STYLES.items():
        line = ET.SubElement(ET.SubElement(document, "Style", id=name), "LineStyle")
        ET.SubElement(line, "color").text = color
        ET.SubElement(line, "width").text = width
    waypoints = [waypoint.position_enu_m for waypoint in plan.waypoints]
    duration_s = plan.trajectory.time_s[-1] - plan.trajectory.time_s[0]
    selected = f"{duration_s:.0f} s, ergodic metric {plan.metric.ergodic_metric:.4g}"
    _geometry(_placemark(document, "Path", selected, "path"), "LineString", _coordinates(waypoints, origin))
    for name, position in (("Start", waypoints[0]), ("End", waypoints[-1]), ("Home", plan.flight.home_enu_m)):
        _geometry(_placemark(document, name, "", None), "Point", _coordinates([position], origin))
    floor_m = plan.limits.box_min_enu_m[2]
    corners = [(east, north, floor_m) for east, north in [*plan.flight.fence_enu_m, plan.flight.fence_enu_m[0]]]
    _geometry(_placemark(document, "Fence", "", "fence"), "LineString", _coordinates(corners, origin))
    shown, all_others = others_of(plan), len(plan.candidates) - 1
    others = ET.SubElement(document, "Folder")
    best = "" if len(shown) == all_others else f" (the best {len(shown)} of {all_others})"
    ET.SubElement(others, "name").text = f"Other candidates{best}"
    ET.SubElement(others, "visibility").text = "0"
    for index, candidate in shown:
        metric = "not finite" if candidate.ergodic_metric is None else f"{candidate.ergodic_metric:.4g}"
        said = f"from {candidate.seed_pattern}, ergodic metric {metric}"
        placemark = _placemark(others, f"Candidate {index}", said, "candidate")
        _geometry(placemark, "LineString", _coordinates(candidate.position_enu_m, origin))
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
