"""Bytes to and from a vehicle: UDP, TCP or a serial line, behind one small interface.

Only loopback is listened on unless another address is asked for.
"""

from __future__ import annotations

import contextlib
import functools
import os
import select
import socket
import termios
import threading
import time
import tty
from collections.abc import Callable
from typing import Protocol

from sim_bridge.link.address import Address, Serial, Tcp, UdpListen, UdpSend

_LARGEST_READ = 65536
_CONNECT_S = 5.0
_REOPEN_S = 1.0


class Wire(Protocol):
    """Something that carries bytes both ways, and outlives its line: one that is gone is tried again and again.

    Whoever listens notices only silence; the flight knows what a silence means.
    """

    datagrams: bool
    """Whether bytes come in datagrams, each whole; else in a stream, cut anywhere."""

    def receive(self, timeout_s: float) -> bytes:
        """What arrived, waiting at most so long; empty: nothing did."""
        ...

    def send(self, data: bytes) -> None:
        """Send, or lose: nothing here waits for a peer."""
        ...

    def believe(self) -> None:
        """What was received last came from the vehicle: answers go where it came from."""
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
        case Tcp():
            return _FileWire(functools.partial(_connected, address))
        case Serial():
            return _FileWire(functools.partial(_opened, address))


class _UdpWire:
    datagrams = True

    def __init__(self, bind: tuple[str, int] | None, remote: tuple[str, int] | None) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        self._listens = bind is not None
        self._remote = remote
        self._sender: tuple[str, int] | None = None
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
            data, self._sender = self._socket.recvfrom(_LARGEST_READ)
        except (TimeoutError, ConnectionRefusedError):
            # Refused: what we sent earlier met a closed port; the vehicle may still come.
            return b""
        except OSError:
            # The network is down, and may come back.
            time.sleep(timeout_s)
            return b""
        return data if self._listens or self._sender == self._remote else b""

    def send(self, data: bytes) -> None:
        if self._remote is not None:
            with contextlib.suppress(OSError):
                self._socket.sendto(data, self._remote)

    def believe(self) -> None:
        if self._listens:
            self._remote = self._sender

    def close(self) -> None:
        self._socket.close()


class _FileWire:
    """A file descriptor; one that breaks is closed and opened anew, once a second."""

    datagrams = False

    def __init__(self, open_file: Callable[[], int]) -> None:
        self._open = open_file
        self._lock = threading.Lock()
        self._closed = False
        self._file: int | None = open_file()

    def receive(self, timeout_s: float) -> bytes:
        file = self._file
        if file is None:
            time.sleep(_REOPEN_S)
            self._reopen()
            return b""
        try:
            ready, _, _ = select.select([file], [], [], max(timeout_s, 1e-3))
            data = os.read(file, _LARGEST_READ) if ready else b""
        except BlockingIOError:
            return b""
        except OSError:
            ready, data = [file], b""
        if ready and not data:
            # Readable and empty: the other end is gone.
            self._drop()
        return data

    def send(self, data: bytes) -> None:
        with self._lock:
            if self._file is not None:
                # What a broken line loses is noticed as silence, by who receives.
                with contextlib.suppress(OSError):
                    os.write(self._file, data)

    def believe(self) -> None:
        pass

    def close(self) -> None:
        self._closed = True
        self._drop()

    def _drop(self) -> None:
        with self._lock:
            file, self._file = self._file, None
            if file is not None:
                os.close(file)

    def _reopen(self) -> None:
        if self._closed:
            return
        with contextlib.suppress(OSError):
            file = self._open()
            with self._lock:
                if not self._closed:
                    self._file = file
                    return
            os.close(file)


def _connected(address: Tcp) -> int:
    try:
        line = socket.create_connection((address.host, address.port), timeout=_CONNECT_S)
    except OSError as error:
        raise OSError(f"TCP {address.host}:{address.port}: {error.strerror or error}") from error
    line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    line.setblocking(False)
    return line.detach()


def _opened(address: Serial) -> int:
    try:
        file = os.open(address.device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError as error:
        raise OSError(f"serial {address.device}: {error.strerror}") from error
    try:
        tty.setraw(file)
        settings = termios.tcgetattr(file)
        settings[4] = settings[5] = getattr(termios, f"B{address.baud}")
        settings[2] |= termios.CLOCAL | termios.CREAD
        termios.tcsetattr(file, termios.TCSANOW, settings)
    except termios.error as error:
        os.close(file)
        raise OSError(f"serial {address.device}: {error}: it is not a serial line") from error
    return file
