"""A plan in the formats of other programs, a file a format; each is a function from a plan to the file's text."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mission.plan_file import PlanFile


class Format(enum.Enum):
    """The formats, named as on the command line."""

    QGC = "qgc"
    WPL = "wpl"
    CSV = "csv"
    GEOJSON = "geojson"
    KML = "kml"

    @property
    def suffix(self) -> str:
        """What the format's files end in."""
        match self:
            case Format.QGC:
                return ".plan"
            case Format.WPL:
                return ".waypoints"
            case Format.CSV | Format.GEOJSON | Format.KML:
                return f".{self.value}"


def exported(plan: PlanFile, format: Format) -> str:
    """A plan as the text of a file.

    Raises:
        ValueError: The format cannot hold the plan.
    """
    match format:
        case Format.QGC:
            from mission.exports.qgroundcontrol import qgroundcontrol_plan

            return qgroundcontrol_plan(plan)
        case Format.WPL:
            from mission.exports.wpl import waypoint_list

            return waypoint_list(plan)
        case Format.CSV:
            from mission.exports.table import sample_table

            return sample_table(plan)
        case Format.GEOJSON:
            from mission.exports.geojson import feature_collection

            return feature_collection(plan)
        case Format.KML:
            from mission.exports.kml import keyhole_markup

            return keyhole_markup(plan)
