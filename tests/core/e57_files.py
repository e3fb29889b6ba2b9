"""Writes E57 files, odd and broken ones too, which libE57Format would not write."""

import struct
from itertools import cycle

import numpy as np

BODY, PAGE = 1020, 1024  # bytes of a page without its checksum, and with it
HEAD = 48


def make_table():
    """Return what each byte does to a CRC-32C."""
    table = list(range(256))
    for _ in range(8):
        table = [(entry >> 1) ^ (0x82F63B78 if entry & 1 else 0) for entry in table]
    return table


TABLE = make_table()


def checksum(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc = TABLE[(crc ^ byte) & 0xFF] ^ (crc >> 8)
    return crc ^ 0xFFFFFFFF


def seal(data):
    """Divide bytes into pages with checksums."""
    pages = (data[place : place + BODY].ljust(BODY, b"\0") for place in range(0, len(data), BODY))
    return b"".join(page + struct.pack(">I", checksum(page)) for page in pages)


def unseal(data):
    return b"".join(data[place : place + BODY] for place in range(0, len(data), PAGE))


def offset(place):
    """Return where in the file a byte of the sealed data lies."""
    return place // BODY * PAGE + place % BODY


def integer(values, low, high, kind="Integer", more=""):
    """Return the attributes of a field and its bytes: numbers of as many bits as the limits need, the lowest first."""
    width = (high - low).bit_length()
    bits = [(int(value) - low) >> bit & 1 for value in values for bit in range(width)]
    return f'type="{kind}" minimum="{low}" maximum="{high}"{more}', np.packbits(
        np.array(bits, np.uint8), bitorder="little"
    ).tobytes()


def scaled(values, low, high, scale, start=0.0):
    return integer(values, low, high, "ScaledInteger", f' scale="{scale!r}" offset="{start!r}"')


def real(values, kind="f8"):
    precision = ' precision="single"' if kind == "f4" else ""
    return f'type="Float"{precision}', np.asarray(values, f"<{kind}").tobytes()


def text(words):
    return 'type="String"', b"".join(bytes([2 * len(word)]) + word.encode() for word in words)


def points(places, kind="f8"):
    return {f"cartesian{axis}": real(column, kind) for axis, column in zip("XYZ", np.transpose(places), strict=True)}


def pose(rotation, translation):
    """Return XML of how a scan is turned, by w x y z, and where the scanner stood."""
    result = ""
    for name, axes, values in (("rotation", "wxyz", rotation), ("translation", "xyz", translation)):
        numbers = (f"<{axis}>{float(value)!r}</{axis}>" for axis, value in zip(axes, values, strict=True))
        result += f"<{name}>{''.join(numbers)}</{name}>"
    return f"<pose>{result}</pose>"


def make_packets(streams, sizes):
    """Divide streams among packets, each taking bytes by sizes in turn, and put other packets between."""
    result, places, sizes = [], [0] * len(streams), cycle(sizes)
    while True:
        parts = []
        for index, stream in enumerate(streams):
            parts.append(stream[places[index] : places[index] + next(sizes)])
            places[index] += len(parts[-1])
        if not any(parts):
            return b"".join(result)
        body = struct.pack(f"<H{len(parts)}H", len(parts), *map(len, parts)) + b"".join(parts)
        body += bytes(-len(body) % 4)
        result.append(struct.pack("<BBH", 1, 0, len(body) + 3) + body)
        if len(result) % 5 == 2:
            result.append(struct.pack("<BBHHB9x", 0, 0, 31, 1, 0) + b"\xff" * 16)
            result.append(struct.pack("<BBH4x", 2, 0, 7))


def make_e57(*scans, sizes=(2000,), xml=lambda text: text):
    """Make a file of scans: fields, number of points, and XML that describes more; as bytes before they are sealed."""
    data, described = bytearray(HEAD), ""
    for fields, count, more in scans:
        packets = make_packets([stream for _, stream in fields.values()], sizes)
        place = len(data)
        data += struct.pack("<B7xQQ8x", 1, 32 + len(packets), offset(place + 32)) + packets
        prototype = "".join(f"<{name} {attributes}/>" for name, (attributes, _) in fields.items())
        described += f'<vectorChild type="Structure">{more}<points type="CompressedVector"'
        described += f' fileOffset="{offset(place)}" recordCount="{count}"><prototype type="Structure">{prototype}'
        described += '</prototype><codecs type="Vector"/></points></vectorChild>'
    described = xml(
        '<?xml version="1.0" encoding="UTF-8"?>\n<e57Root type="Structure"'
        ' xmlns="http://www.astm.org/COMMIT/E57/2010-e57-v1.0" xmlns:nor="http://www.libe57.org/normals">'
        f'<data3D type="Vector">{described}</data3D></e57Root>'
    ).encode()
    place = len(data)
    data += described
    length = offset(-(-len(data) // BODY) * BODY)
    struct.pack_into("<8sIIQQQQ", data, 0, b"ASTM-E57", 1, 0, length, offset(place), len(described), PAGE)
    return bytes(data)
