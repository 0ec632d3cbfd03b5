"""The simulated vehicle's links, in both directions."""

import os
import socket
import tty

import pytest

from tools.sitl.errors import TransportError
from tools.sitl.transport import SCHEMES, TcpServer, Transport, Udp, open_transport


def receive(transport: Transport, size: int) -> bytes:
    """Bytes until there are enough of them or two seconds passed without any."""
    got = b""
    while len(got) < size:
        before = len(got)
        for _ in range(20):
            got += transport.receive(0.1)
            if len(got) > before:
                break
        else:
            break
    return got


def exchange(first: Transport, second: Transport) -> None:
    first.send(b"hello")
    assert receive(second, 5) == b"hello"
    second.send(b"world")
    assert receive(first, 5) == b"world"


def test_udp_speaks_first_or_answers():
    listener = Udp("127.0.0.1", 0, speaks_first=False)
    port = listener.socket.getsockname()[1]
    listener.send(b"nobody is there yet")
    speaker = open_transport(f"udpout:127.0.0.1:{port}")
    exchange(speaker, listener)
    listener.close()
    for _ in range(3):
        speaker.send(b"the other side has gone")
        assert speaker.receive(0.01) == b""
    speaker.close()
    speaker.close()


def test_tcp_server_takes_one_peer_after_the_other():
    server = TcpServer("127.0.0.1", 0)
    server.send(b"nobody is there yet")
    for _ in range(2):
        client = open_transport(f"tcp:127.0.0.1:{server.port}")
        assert server.receive(1.0) == b""
        exchange(client, server)
        client.close()
        assert server.receive(1.0) == b""
    server.close()


def test_tcp_client_says_when_the_other_side_has_gone():
    server = TcpServer("127.0.0.1", 0)
    client = open_transport(f"tcp:127.0.0.1:{server.port}")
    server.receive(1.0)
    server.close()
    with pytest.raises(TransportError, match="has closed"):
        client.receive(1.0)
    client.close()


def test_serial_port_carries_bytes_and_says_when_it_is_unplugged():
    ground, vehicle = os.openpty()
    tty.setraw(ground)
    port = open_transport(f"serial:{os.ttyname(vehicle)}:57600")
    port.send(b"\xfd\x00\n\r")
    assert os.read(ground, 10) == b"\xfd\x00\n\r"
    os.write(ground, b"world")
    assert receive(port, 5) == b"world"
    os.close(ground)
    with pytest.raises(TransportError, match="has gone"):
        receive(port, 1)
    port.close()
    os.close(vehicle)


@pytest.mark.parametrize(
    "url",
    [
        "",
        "pigeon:127.0.0.1:1",
        "udp:127.0.0.1",
        "udpout:127.0.0.1:many",
        "udpout::14550",
        "tcp:127.0.0.1:70000",
        "tcp:127.0.0.1:1",
        "serial:",
        "serial:/dev/no_such_tty:115200",
        "serial:/dev/null:fast",
        "udpout:no.such.host.invalid:14550",
    ],
)
def test_link_that_cannot_be_is_refused_in_one_line(url):
    with pytest.raises(TransportError, match=r".") as caught:
        open_transport(url)
    assert "\n" not in str(caught.value)


def test_port_in_use_is_refused():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        with pytest.raises(TransportError, match="in use"):
            open_transport(f"udp:127.0.0.1:{taken.getsockname()[1]}")


def test_schemes_are_the_documented_ones():
    assert list(SCHEMES) == ["udpout", "udp", "tcp", "tcpin", "serial"]
