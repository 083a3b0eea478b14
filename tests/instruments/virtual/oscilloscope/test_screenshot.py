"""Pictures of the virtual oscilloscopes' screens."""

import io
import struct
import zlib

import pytest

from support.scopes import block, keysight, pulses, rigol
from support.wire import received, send


def png_size(data):
    """Width and height; every part's sum is checked and the pixels unpacked."""
    stream = io.BytesIO(data)
    assert stream.read(8) == b"\x89PNG\r\n\x1a\n"
    parts = {}
    while head := stream.read(8):
        length, kind = struct.unpack(">I4s", head)
        content = stream.read(length)
        assert stream.read(4) == struct.pack(">I", zlib.crc32(kind + content))
        parts[kind] = content
    width, height = struct.unpack(">II", parts[b"IHDR"][:8])
    assert len(zlib.decompress(parts[b"IDAT"])) == height * (1 + 3 * width)
    return width, height


@pytest.mark.parametrize(("make", "question"), [(rigol, ":DISP:DATA? ON,OFF,PNG"), (keysight, ":DISP:DATA? PNG, COL")])
def test_the_picture_is_a_png(make, question):
    assert png_size(block(make(pulses), question)[1]) == (800, 480)


def test_the_picture_of_the_rigol_is_by_default_a_bmp_of_the_size_that_public_drivers_expect():
    send(device := rigol(pulses), b":DISP:DATA?\n")
    assert len(received(device, 10.0)) == 1_152_068
