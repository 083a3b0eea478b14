"""The port mapper: RFC 1833's bytes over TCP and UDP, hostile datagrams, and pyvisa-py's client."""

import contextlib
import socket
import struct

import pytest
from pyvisa_py.protocols.rpc import TCPPortMapperClient, UDPPortMapperClient

from instruments.virtual.servers.server import ListenAt
from support.served import AT_MOST, rpc, serving

#: The first instrument's address.  macOS has 127.0.0.1 alone, unless a person adds others.
HOST = "127.0.0.2"


def _there(host):
    with socket.socket() as probe, contextlib.suppress(OSError):
        probe.bind((host, 0))
        return True
    return False


pytestmark = pytest.mark.skipif(not _there(HOST), reason=f"this system has no address {HOST}")

#: VXI-11's core and abort channel, the port mapper; TCP, UDP.
CORE, ABORT, MAPPER = 0x0607AF, 0x0607B0, 100000
TCP, UDP = 6, 17


def port_of(host):
    """A port that is free for TCP and UDP."""
    with socket.socket() as stream, socket.socket(type=socket.SOCK_DGRAM) as datagrams:
        stream.bind((host, 0))
        port = stream.getsockname()[1]
        datagrams.bind((host, port))
        return port


@pytest.fixture(scope="module")
def mapped():
    """The port of the first instrument's port mapper, and that of its core channel."""
    port = port_of(HOST)
    with serving(listen_at=ListenAt(port_mapper=port)) as served:
        # TCPIP0::127.0.0.2,40123::inst0::INSTR: with its port, for the mapper is not at 111
        name = served.names()["vxi11"]
        assert name.startswith(f"TCPIP0::{HOST},")
        yield port, int(name.split(",")[1].split("::")[0])


def call(procedure, *parameters, program=MAPPER, version=2, number=7):
    """RFC 5531, section 9: number, CALL, RPC version 2, program, version, procedure, no credentials, no verifier."""
    return struct.pack("!10I", number, 0, 2, program, version, procedure, 0, 0, 0, 0) + struct.pack(
        f"!{len(parameters)}I", *parameters
    )


def test_the_bytes_of_a_question_for_a_port_and_of_its_answer(mapped):
    port, core = mapped
    asked = bytes.fromhex(
        "00000007 00000000 00000002 000186a0 00000002 00000003" + 16 * "00" + "000607af 00000001 00000006 00000000"
    )
    with socket.socket(type=socket.SOCK_DGRAM) as client:
        client.settimeout(AT_MOST)
        client.sendto(asked, (HOST, port))
        assert client.recv(100) == bytes.fromhex("00000007 00000001" + 16 * "00") + struct.pack("!I", core)


@pytest.mark.parametrize(
    ("program", "version", "protocol", "known"),
    [
        (CORE, 1, TCP, True),
        (ABORT, 1, TCP, True),
        (CORE, 1, UDP, False),
        (CORE, 2, TCP, False),
        (100003, 3, TCP, False),
    ],
)
def test_a_program_that_is_not_there_has_the_port_0(mapped, program, version, protocol, known):
    port, _ = mapped
    with socket.create_connection((HOST, port), timeout=AT_MOST) as connection:
        *head, found = rpc(connection, MAPPER, 2, 3, struct.pack("!4I", program, version, protocol, 0))
    assert head == [1, 0, 0, 0, 0]
    assert (found != 0) == known


def test_nothing_can_be_registered_and_no_call_is_passed_on(mapped):
    port, _ = mapped
    with socket.create_connection((HOST, port), timeout=AT_MOST) as connection:
        for procedure in (1, 2):
            assert rpc(connection, MAPPER, 2, procedure, struct.pack("!4I", 1, 1, TCP, 5)) == [1, 0, 0, 0, 0, 0]
        assert rpc(connection, MAPPER, 2, 0) == [1, 0, 0, 0, 0]
        assert rpc(connection, MAPPER, 2, 5) == [1, 0, 0, 0, 3]  # the procedure is not there
        assert rpc(connection, MAPPER, 4, 3) == [1, 0, 0, 0, 2, 2, 2]  # versions 2 to 2 are there
        assert rpc(connection, CORE, 1, 10) == [1, 0, 0, 0, 1]  # the program is elsewhere
        assert rpc(connection, MAPPER, 2, 3, b"abcd") == [1, 0, 0, 0, 4]


@pytest.mark.parametrize("client", [TCPPortMapperClient, UDPPortMapperClient])
def test_pyvisas_own_client_lists_the_programs(mapped, monkeypatch, client):
    port, core = mapped
    monkeypatch.setattr("pyvisa_py.protocols.rpc.PMAP_PORT", port)
    with contextlib.closing(client(HOST)) as mapper:
        assert mapper.get_port((CORE, 1, TCP, 0)) == core
        programs = {entry[:3]: entry[3] for entry in mapper.dump()}
    assert set(programs) == {(CORE, 1, TCP), (ABORT, 1, TCP), (MAPPER, 2, TCP), (MAPPER, 2, UDP)}
    assert programs[CORE, 1, TCP] == core


HOSTILE = {
    "nothing": b"",
    "one byte": b"\x00",
    "another protocol": b"GET / HTTP/1.1\r\n\r\n",
    "an answer, not a call": struct.pack("!7I", 7, 1, 0, 0, 0, 0, 111),
    "another version of RPC": struct.pack("!10I", 7, 0, 3, MAPPER, 2, 3, 0, 0, 0, 0) + bytes(16),
    "cut in its head": call(3, CORE, 1, TCP, 0)[:37],
    "credentials without an end": struct.pack("!8I", 7, 0, 2, MAPPER, 2, 3, 0, 0xFFFFFFFF) + bytes(16),
    "the longest datagram": call(3, CORE, 1, TCP, 0, number=8)[:30] + b"\xff" * 60_000,
}


@pytest.mark.parametrize("what", HOSTILE)
def test_a_datagram_that_is_no_call_has_no_answer_and_does_no_harm(mapped, what):
    port, core = mapped
    with socket.socket(type=socket.SOCK_DGRAM) as client:
        client.settimeout(AT_MOST)
        for _ in range(3):
            client.sendto(HOSTILE[what], (HOST, port))
        client.sendto(call(3, CORE, 1, TCP, 0, number=9), (HOST, port))
        assert struct.unpack("!7I", client.recv(100)) == (9, 1, 0, 0, 0, 0, core)  # the first answer there is


def test_a_call_without_its_parameters_is_refused_over_udp_too(mapped):
    port, _ = mapped
    with socket.socket(type=socket.SOCK_DGRAM) as client:
        client.settimeout(AT_MOST)
        client.sendto(call(3), (HOST, port))
        assert struct.unpack("!6I", client.recv(100)) == (7, 1, 0, 0, 0, 4)
