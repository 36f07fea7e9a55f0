"""Lines that break: the flight hears silence, and the line again when it is back."""

import errno
import os
import pty
import socket
import time

import pytest

from sim_bridge.link.address import Serial, Tcp, UdpListen, UdpSend
from sim_bridge.link.wire import open_wire

LONGEST_S = 20.0


def received(wire, wanted: bytes) -> bool:
    until, data = time.monotonic() + LONGEST_S, b""
    while wanted not in data and time.monotonic() < until:
        data += wire.receive(0.05)
    return wanted in data


def listening(port: int = 0) -> socket.socket:
    server = socket.socket()
    server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    server.bind(("127.0.0.1", port))
    server.listen()
    return server


def test_a_tcp_line_whose_other_end_starts_anew_is_taken_up_again():
    server = listening()
    port = server.getsockname()[1]
    wire = open_wire(Tcp("127.0.0.1", port))
    peer, _ = server.accept()
    peer.sendall(b"before")
    assert received(wire, b"before")
    peer.close()
    server.close()
    for _ in range(3):
        assert wire.receive(0.01) == b""
        wire.send(b"into the void")
    server = listening(port)
    server.settimeout(LONGEST_S)
    assert wire.receive(0.01) == b""
    peer, _ = server.accept()
    peer.sendall(b"after")
    assert received(wire, b"after")
    wire.send(b"answer")
    assert peer.recv(100) == b"answer"
    wire.close()
    peer.close()
    server.close()


def test_a_serial_line_that_is_unplugged_is_silent():
    ours, theirs = pty.openpty()
    wire = open_wire(Serial(os.ttyname(theirs), 57600))
    os.write(ours, b"before")
    assert received(wire, b"before")
    wire.send(b"answer")
    assert os.read(ours, 100) == b"answer"
    os.close(ours)
    os.close(theirs)
    for _ in range(2):
        assert wire.receive(0.01) == b""
        wire.send(b"into the void")
    wire.close()


def test_a_device_that_is_no_serial_line_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="not a serial line"):
        open_wire(Serial(str(tmp_path / "file"), 57600))


class Down:
    """A socket whose network is gone."""

    def __init__(self, error: int) -> None:
        self.error = OSError(error, os.strerror(error))

    def settimeout(self, _):
        pass

    def recvfrom(self, _):
        raise self.error

    def sendto(self, *_):
        raise self.error


@pytest.mark.parametrize("error", [errno.ENETDOWN, errno.ENETUNREACH, errno.EHOSTUNREACH, errno.EPERM, errno.ENOBUFS])
def test_a_network_that_is_down_is_silence_and_not_the_end(error):
    peer = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    peer.bind(("127.0.0.1", 0))
    wire = open_wire(UdpSend(*peer.getsockname()))
    wire.send(b"before")
    _, place = peer.recvfrom(100)
    up, wire._socket = wire._socket, Down(error)
    wire.send(b"into the void")
    assert wire.receive(0.01) == b""
    wire._socket = up
    peer.sendto(b"after", place)
    assert received(wire, b"after")
    wire.close()
    peer.close()


def test_answers_go_to_whoever_is_believed_and_to_nobody_else():
    vehicle, stranger = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
    wire = open_wire(UdpListen("127.0.0.1", 0))
    place = wire._socket.getsockname()
    for peer in (vehicle, stranger):
        peer.bind(("127.0.0.1", 0))
        peer.settimeout(LONGEST_S)
    wire.send(b"nobody is there yet")
    vehicle.sendto(b"it is me", place)
    assert received(wire, b"it is me")
    wire.believe()
    stranger.sendto(b"no, me", place)
    assert received(wire, b"no, me")
    wire.send(b"setpoint")
    assert vehicle.recv(100) == b"setpoint"
    stranger.settimeout(0.05)
    with pytest.raises(TimeoutError):
        stranger.recv(100)
    for one in (wire, vehicle, stranger):
        one.close()
