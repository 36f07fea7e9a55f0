"""Where a link leads: UDP, TCP or a serial line, as a text."""

from __future__ import annotations

import dataclasses
from urllib.parse import urlsplit

DEFAULT_UDP_PORT = 14540
DEFAULT_TCP_PORT = 5760
DEFAULT_BAUD = 57600
BAUDS = (9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600)


@dataclasses.dataclass(frozen=True)
class UdpListen:
    """Wait for the vehicle to speak on a port of this machine, and answer whoever spoke last."""

    host: str
    port: int


@dataclasses.dataclass(frozen=True)
class UdpSend:
    """Speak first, to a known host and port."""

    host: str
    port: int


@dataclasses.dataclass(frozen=True)
class Tcp:
    """Connect to a host and port."""

    host: str
    port: int


@dataclasses.dataclass(frozen=True)
class Serial:
    """A serial device."""

    device: str
    baud: int


Address = UdpListen | UdpSend | Tcp | Serial


def parse_address(text: str) -> Address:
    """Read a link's address.

    Args:
        text: `udp://HOST:PORT` (listens; no host: loopback), `udpout://HOST:PORT`, `tcp://HOST:PORT` or
            `serial:///dev/ttyUSB0:57600`.

    Raises:
        ValueError: Another scheme, or a part that cannot be read.
    """
    wanted = "udp://:14540, udpout://192.168.1.10:14550, tcp://127.0.0.1:5760 or serial:///dev/ttyUSB0:57600"
    try:
        parts = urlsplit(text)
    except ValueError as error:
        raise ValueError(f'"{text}" is not a link ({error}): write {wanted}') from error
    if parts.scheme == "serial":
        device, _, baud = (parts.netloc + parts.path).partition(":")
        if not device or (baud and baud not in map(str, BAUDS)):
            raise ValueError(f'"{text}" names no serial line: write {wanted}; rates: {", ".join(map(str, BAUDS))}')
        return Serial(device, int(baud) if baud else DEFAULT_BAUD)
    try:
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise ValueError(f'"{text}" has a port that is not one ({error}): write {wanted}') from error
    if port == 0:
        raise ValueError(f'"{text}" has a port that is not one: write {wanted}')
    match parts.scheme:
        case "udp" | "udpin":
            return UdpListen(host or "127.0.0.1", port or DEFAULT_UDP_PORT)
        case "udpout" if host:
            return UdpSend(host, port or DEFAULT_UDP_PORT)
        case "tcp" | "tcpout" if host:
            return Tcp(host, port or DEFAULT_TCP_PORT)
        case _:
            raise ValueError(f'"{text}" is not a link: write {wanted}')
