"""The mission as one value: every section, parsed, in local ENU metres and seconds."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, Strict

from mission.mission_file.flight import Belief, Flight, Link, Replanning, Sensor
from mission.mission_file.information import Information, Raster
from mission.mission_file.obstacle import NoFly, Obstacle
from mission.mission_file.planner import Planner
from mission.mission_file.site import Site
from mission.mission_file.values import Section
from mission.mission_file.vehicle import Vehicle
from sim_bridge.frames import geodetic_from_enu
from sim_bridge.state import GeodeticPoint

# For a search: modes for each swath along an axis, and no more than pay.
MODES_A_SWATH = 1.4
MOST_MODES = 48


class Mission(Section):
    """What to explore, with what, and how."""

    name: str = ""
    """What the mission is called; absent: the file's name."""
    site: Site
    information: Information
    obstacle: Annotated[tuple[Obstacle, ...], Strict(False)] = ()
    no_fly: Annotated[tuple[NoFly, ...], Strict(False)] = ()
    vehicle: Vehicle = Field(default_factory=lambda: Vehicle.model_validate({}))
    planner: Planner
    sensor: Sensor = Sensor()
    belief: Belief = Belief()
    flight: Flight = Flight()
    replanning: Replanning = Replanning()
    link: Link = Link()

    @property
    def home_enu_m(self) -> tuple[float, float, float]:
        """Where the vehicle stands before take-off."""
        if self.site.home_enu_m is not None:
            return self.site.home_enu_m
        return (*self.planner.start_enu_m[:2], 0.0)

    @property
    def home_geodetic(self) -> GeodeticPoint:
        """The same on the globe."""
        return geodetic_from_enu(self.home_enu_m, self.site.origin.point())

    @property
    def takeoff_altitude_m(self) -> float:
        """Height above where the vehicle stands to climb to before flying to the start."""
        if self.flight.takeoff_altitude_m is not None:
            return self.flight.takeoff_altitude_m
        return self.planner.start_enu_m[2] - self.home_enu_m[2]

    @property
    def keep_out_m(self) -> float:
        """Least distance from the vehicle's middle to an obstacle's surface."""
        return self.vehicle.radius_m + self.flight.clearance_margin_m

    @property
    def modes(self) -> tuple[int, int, int]:
        """Basis functions along east, north and up, where none are given as fine as there is something to resolve."""
        if self.planner.modes is not None:
            return self.planner.modes
        searching = self.belief.kind == "detection"
        flat = searching or isinstance(self.information, Raster)
        counts = [8, 8]
        if searching and self.sensor.swath_m is not None:
            (west, south, _), (east, north, _) = self.site.box_m
            wanted = (round(MODES_A_SWATH * side / self.sensor.swath_m) for side in (east - west, north - south))
            counts = [min(max(count, 8), MOST_MODES) for count in wanted]
        return (counts[0], counts[1], 1 if flat else 4)

    @property
    def time_step_s(self) -> float | None:
        """Time between the samples of the metric; None: the planner chooses."""
        if self.planner.samples is not None:
            return self.planner.duration_s / self.planner.samples
        return self.planner.time_step_s
