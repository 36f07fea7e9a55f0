"""Bytes to and from a vehicle: UDP, TCP or a serial line, behind one small interface.

Only loopback is listened on unless another address is asked for.
"""

from __future__ import annotations

import dataclasses
import os
import select
import socket
import termios
import tty
from typing import Protocol
from urllib.parse import urlsplit

DEFAULT_UDP_PORT = 14540
DEFAULT_TCP_PORT = 5760
DEFAULT_BAUD = 57600
_LARGEST_READ = 65536
_BAUDS = {rate: getattr(termios, f"B{rate}") for rate in (9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600)}


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
    parts = urlsplit(text)
    wanted = "udp://:14540, udpout://192.168.1.10:14550, tcp://127.0.0.1:5760 or serial:///dev/ttyUSB0:57600"
    if parts.scheme == "serial":
        device, _, baud = (parts.netloc + parts.path).partition(":")
        if not device or (baud and baud not in map(str, _BAUDS)):
            raise ValueError(f'"{text}" names no serial line: write {wanted}; rates: {", ".join(map(str, _BAUDS))}')
        return Serial(device, int(baud) if baud else DEFAULT_BAUD)
    try:
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise ValueError(f'"{text}" has a port that is not one ({error}): write {wanted}') from error
    match parts.scheme:
        case "udp" | "udpin":
            return UdpListen(host or "127.0.0.1", port or DEFAULT_UDP_PORT)
        case "udpout" if host:
            return UdpSend(host, port or DEFAULT_UDP_PORT)
        case "tcp" | "tcpout" if host:
            return Tcp(host, port or DEFAULT_TCP_PORT)
        case _:
            raise ValueError(f'"{text}" is not a link: write {wanted}')


class Wire(Protocol):
    """Something that carries bytes both ways."""

    def receive(self, timeout_s: float) -> bytes:
        """What arrived, waiting at most so long; empty: nothing did."""
        ...

    def send(self, data: bytes) -> None:
        """Send, or lose: nothing here waits for a peer."""
        ...

    def close(self) -> None:
        """Let go of the line."""
        ...


def open_wire(address: Address) -> Wire:
    """Open a line.

    Raises:
        OSError: The line cannot be opened; the text says which and why.
    """
    match address:
        case UdpListen(host, port):
            return _UdpWire(bind=(host, port), remote=None)
        case UdpSend(host, port):
            return _UdpWire(bind=None, remote=(host, port))
        case Tcp(host, port):
            return _TcpWire(host, port)
        case Serial(device, baud):
            return _SerialWire(device, baud)


class _UdpWire:
    def __init__(self, bind: tuple[str, int] | None, remote: tuple[str, int] | None) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        self._listens = bind is not None
        self._remote = remote
        try:
            if bind is not None:
                self._socket.bind(bind)
            elif remote is not None:
                self._remote = (socket.gethostbyname(remote[0]), remote[1])
                self._socket.bind(("", 0))
        except OSError as error:
            self._socket.close()
            place = bind or remote
            raise OSError(f"UDP {place}: {error.strerror}: another program may hold the port") from error

    def receive(self, timeout_s: float) -> bytes:
        self._socket.settimeout(max(timeout_s, 1e-3))
        try:
            data, sender = self._socket.recvfrom(_LARGEST_READ)
        except (TimeoutError, ConnectionRefusedError):
            # Refused: what we sent earlier met a closed port; the vehicle may still come.
            return b""
        if self._listens:
            self._remote = sender
        elif sender != self._remote:
            return b""
        return data

    def send(self, data: bytes) -> None:
        if self._remote is None:
            return
        try:
            self._socket.sendto(data, self._remote)
        except (BlockingIOError, ConnectionRefusedError):
            return

    def close(self) -> None:
        self._socket.close()


class _TcpWire:
    def __init__(self, host: str, port: int) -> None:
        try:
            self._socket = socket.create_connection((host, port), timeout=5.0)
        except OSError as error:
            raise OSError(f"TCP {host}:{port}: {error.strerror or error}") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def receive(self, timeout_s: float) -> bytes:
        ready, _, _ = select.select([self._socket], [], [], max(timeout_s, 1e-3))
        return self._socket.recv(_LARGEST_READ) if ready else b""

    def send(self, data: bytes) -> None:
        try:
            self._socket.sendall(data)
        except (TimeoutError, BrokenPipeError, ConnectionResetError):
            # The silence that follows is noticed as a lost link.
            return

    def close(self) -> None:
        self._socket.close()


class _SerialWire:
    def __init__(self, device: str, baud: int) -> None:
        try:
            self._file = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            raise OSError(f"serial {device}: {error.strerror}") from error
        tty.setraw(self._file)
        settings = termios.tcgetattr(self._file)
        settings[4] = settings[5] = _BAUDS[baud]
        settings[2] |= termios.CLOCAL | termios.CREAD
        termios.tcsetattr(self._file, termios.TCSANOW, settings)

    def receive(self, timeout_s: float) -> bytes:
        ready, _, _ = select.select([self._file], [], [], max(timeout_s, 1e-3))
        return os.read(self._file, _LARGEST_READ) if ready else b""

    def send(self, data: bytes) -> None:
        try:
            os.write(self._file, data)
        except BlockingIOError:
            return

    def close(self) -> None:
        os.close(self._file)
