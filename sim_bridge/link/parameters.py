"""The vehicle's parameters, read and written without knowing their types."""

from __future__ import annotations

from mavsdk import System
from mavsdk.plugins.param import Param, ParamError, ParamResult

from sim_bridge.link.error import LinkError
from sim_bridge.state import finite_on_the_wire


class LinkParameters:
    """Parameters of a vehicle.

    Args:
        system: The vehicle as mavsdk knows it.
    """

    def __init__(self, system: System) -> None:
        self._param = Param(system)

    def read(self, name: str) -> float | None:
        """A parameter's value; None: the vehicle does not have it or does not answer."""
        for read in (self._param.get_param_float, self._param.get_param_int):
            try:
                return float(read(name))
            except ParamError as error:
                # An unknown name is not answered at all; only one of another type is worth a second question.
                if error.result is ParamResult.TIMEOUT:
                    return None
        return None

    def write(self, name: str, value: float) -> None:
        """Write a parameter.

        Raises:
            LinkError: The vehicle did not take it, or it is no number on the wire.
        """
        if not finite_on_the_wire(value):
            raise LinkError(f"parameter {name} needs a finite number, got {value}")
        try:
            self._param.set_param_float(name, value)
        except ParamError:
            try:
                self._param.set_param_int(name, int(value))
            except ParamError as error:
                raise LinkError(f"parameter {name} was not taken: {error.result.name.lower()}") from error
