"""`sim-bridge`: kinematic vehicles that speak MAVLink as PX4 or ArduPilot do."""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from sim_bridge.channel import Quality
from sim_bridge.dialects import Autopilot
from sim_bridge.faults import AnyFault, parse_fault, read_faults
from sim_bridge.frames import geodetic_from_enu
from sim_bridge.signing import Signatures, read_key, time_10us
from sim_bridge.simulator import Simulator, make_autopilot
from sim_bridge.state import GeodeticPoint
from sim_bridge.station import Station
from sim_bridge.telemetry_log import TelemetryLog
from sim_bridge.vehicle.airframes import AirframeKind, airframe
from sim_bridge.vehicle.body import VehicleConfig
from sim_bridge.vehicle.kinematics import Wind

SPACING_M = 5.0

app = typer.Typer(add_completion=False, no_args_is_help=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _numbers(text: str, count: int, option: str, example: str) -> tuple[float, ...]:
    parts = text.split(",")
    try:
        numbers = tuple(float(part) for part in parts)
    except ValueError:
        numbers = ()
    if len(numbers) != count:
        raise typer.BadParameter(
            f'got "{text}", needs {count} numbers with commas between them: {example}', param_hint=option
        )
    return numbers


def _parameter(text: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    try:
        return name, float(value) if equals else float("nan")
    except ValueError:
        raise typer.BadParameter(f'got "{text}", write NAME=NUMBER', param_hint="--param") from None


def _logs(folder: Path | None, systems: Sequence[int]) -> list[TelemetryLog]:
    """A log a vehicle; none where no folder is given."""
    if folder is None:
        return []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return [TelemetryLog(folder / f"vehicle-{system}.tlog", time.time(), _say) for system in systems]
    except OSError as error:
        raise typer.BadParameter(f"cannot be written: {error}", param_hint="--record") from error


def _faults(words: Sequence[str], file: Path | None) -> list[AnyFault]:
    """What is to go wrong, from the command line and from a file.

    Raises:
        ValueError: What cannot be read.
    """
    found = [parse_fault(word) for word in words]
    if file is not None:
        try:
            found += read_faults(file)
        except OSError as error:
            raise typer.BadParameter(f"cannot be opened: {error}", param_hint="--faults") from error
    return found


def _key(file: Path | None) -> bytes | None:
    if file is None:
        return None
    try:
        return read_key(file)
    except OSError as error:
        raise typer.BadParameter(f"cannot be opened: {error}", param_hint="--key-file") from error


def _signatures(key: bytes | None) -> Signatures | None:
    return None if key is None else Signatures(key, time_10us(time.time()))


@app.command()
def run(
    autopilot: Annotated[str, typer.Option(metavar="px4|ardupilot", help="Which autopilot the vehicle is.")] = "px4",
    port: Annotated[int, typer.Option(help="UDP port of the client; vehicle i sends to PORT + i.")] = 14540,
    ground_station: Annotated[
        int | None, typer.Option(help="Talk to a ground station on this UDP port too, usually 14550.")
    ] = None,
    speed: Annotated[float, typer.Option(help="Vehicle seconds a wall second, in lock-step with the setpoints.")] = 1.0,
    vehicles: Annotated[int, typer.Option(min=1, max=100, help="How many; system ids 1, 2, …")] = 1,
    origin: Annotated[
        str, typer.Option("--origin", "--home", metavar="LAT,LON,AMSL", help="Where the first stands.")
    ] = "47.3977,8.5456,488.0",
    wind: Annotated[str, typer.Option(metavar="EAST,NORTH", help="Mean wind, m/s: where the air goes.")] = "0,0",
    gust: Annotated[float, typer.Option(min=0.0, help="Standard deviation of gusts, m/s.")] = 0.0,
    loss: Annotated[float, typer.Option(min=0.0, max=1.0, help="Share of datagrams lost, each way.")] = 0.0,
    delay: Annotated[float, typer.Option(min=0.0, help="Mean delay of datagrams, s.")] = 0.0,
    jitter: Annotated[float, typer.Option(min=0.0, help="Spread of that delay to either side, s.")] = 0.0,
    battery: Annotated[float, typer.Option(min=0.0, max=1.0, help="Charge at the start.")] = 1.0,
    endurance: Annotated[float, typer.Option(min=1.0, help="Time a full battery hovers, s.")] = 1200.0,
    airframe_kind: Annotated[
        AirframeKind, typer.Option("--airframe", help="What the vehicle is built like.")
    ] = AirframeKind.QUADROTOR,
    drag: Annotated[
        float | None,
        typer.Option(min=0.0, max=5.0, help="Deceleration per speed through the air, 1/s; default: the airframe's."),
    ] = None,
    wander: Annotated[float, typer.Option(min=0.0, help="How far the position estimate wanders, m.")] = 0.8,
    ready_after: Annotated[
        float | None, typer.Option(min=0.0, help="From boot until it can be armed, s; default: as the real one.")
    ] = None,
    param: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help="Change a parameter; repeatable.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of everything random.")] = 0,
    fault: Annotated[
        list[str] | None,
        typer.Option(metavar="KIND@BEGIN[+DURATION] [KEY=VALUE …]", help="Something that goes wrong; repeatable."),
    ] = None,
    faults: Annotated[
        Path | None, typer.Option(help="File of such things: [[fault]] tables in TOML, or JSON; see docs/simulator.md.")
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option("--record", "--tlog", help="Keep all that is heard and sent in this folder: vehicle-1.tlog, …"),
    ] = None,
    with_parent: Annotated[bool, typer.Option("--with-parent", help="End when what started it has ended.")] = False,
    key_file: Annotated[
        Path | None, typer.Option(help="Sign with this file's key, and hear only what is signed with it.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Say what runs as one JSON object.")] = False,
) -> None:
    """Fly kinematic vehicles that speak MAVLink 2 over UDP on this machine, until interrupted."""
    kind = {"px4": Autopilot.PX4, "ardupilot": Autopilot.ARDUPILOT}.get(autopilot)
    if kind is None:
        raise typer.BadParameter(f'got "{autopilot}", write px4 or ardupilot', param_hint="--autopilot")
    latitude, longitude, altitude = _numbers(origin, 3, "--origin", "47.3977,8.5456,488.0")
    east, north = _numbers(wind, 2, "--wind", "3,-1.5")
    ground = GeodeticPoint(latitude, longitude, altitude)
    configs = [
        VehicleConfig(
            ground=geodetic_from_enu((SPACING_M * index, 0.0, 0.0), ground) if index else ground,
            system=1 + index,
            airframe=airframe(airframe_kind, endurance, drag),
            wind=Wind((north, east, 0.0), gust),
            parameters=tuple(_parameter(text) for text in param or ()),
            ready_after_s=ready_after,
            battery=battery,
            wander_m=wander,
            seed=seed + index,
        )
        for index in range(vehicles)
    ]
    try:
        quality = Quality(loss=loss, delay_s=delay, jitter_s=jitter)
        wrong = _faults(fault or [], faults)
        key = _key(key_file)
        logs = _logs(record, [config.system for config in configs])
        writers = [log.write for log in logs] or [None] * vehicles
        stations = [
            Station(make_autopilot(kind, config), quality, config.seed, writer, wrong, _signatures(key))
            for config, writer in zip(configs, writers, strict=True)
        ]
        simulator = Simulator(stations, port, speed, ground_station)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    stopped: list[int] = []
    parent = os.getppid()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda got, _frame: stopped.append(got))
    ports = [port + index for index in range(vehicles)]
    if as_json:
        print(json.dumps({"ports": ports, "autopilot": autopilot, "speed": speed}), flush=True)
    else:
        targets = ", ".join(f"udp://127.0.0.1:{one}" for one in ports)
        _say(f"{vehicles} × {autopilot} sending to {targets}; Ctrl-C ends")
    try:
        simulator.run(lambda: bool(stopped) or (with_parent and os.getppid() != parent))
    finally:
        simulator.close()
        for log in logs:
            log.close()
    if simulator.failed:
        raise typer.Exit(1)


def main() -> None:
    """Entry point of `sim-bridge`."""
    app()


if __name__ == "__main__":
    main()
