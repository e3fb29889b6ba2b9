"""Files .spz of Niantic, versions 1 to 3: a header and the numbers of all splats one kind after another, in gzip."""

import os
import struct
import zlib
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from ..errors import InvalidPointsError
from ..files import PlyVertices, unpacks_too_far
from ..types import Array, Floats, Ints
from .columns import COLORS, OPACITY, PLACES, ROTATIONS, SCALES, encode_opacities, rest_names, split
from .ellipsoids import completed_quaternions
from .harmonics import COUNTS

MAGIC = b"NGSP"
GZIP = b"\x1f\x8b"
_HEADER = struct.Struct("<4sIIBBBB")
_NEWEST = 3  # version that is read; later ones are compressed by Zstandard
_BEFORE_SMALLEST_THREE = 2  # version, up to which rotations have three bytes
_EXTENDED = 2  # flag of vendor extensions
_COLORS = 0.15  # of a byte from 0 to 1 for each unit of the constant harmonic

_BLOCK = 1 << 16  # bytes that are unpacked at one time


class _Header(NamedTuple):
    magic: bytes
    version: int
    count: int  # type: ignore[assignment]  # in place of the method of tuples
    degree: int
    fraction: int  # bits of a coordinate behind the point
    flags: int
    reserved: int

    @property
    def widths(self) -> tuple[int, int, int, int, int, int]:
        """How many bytes each splat has of places, opacities, colours, sizes, rotations and harmonics."""
        places = 6 if self.version == 1 else 9
        return places, 1, 3, 3, 3 if self.version <= _BEFORE_SMALLEST_THREE else 4, 3 * COUNTS[self.degree]


def is_spz(path: Path) -> bool:
    """Whether a file is one of .spz, of any version, by its first bytes, compressed or not."""
    with open(path, "rb") as file:
        try:
            return bytes(_Unpacked(file).read(len(MAGIC))) == MAGIC
        except zlib.error:
            return False


def read_spz(path: Path) -> PlyVertices:
    """Read an .spz file as the columns of trainers, in the file's own axes, of which y points upwards.

    One that is no .spz file, broken, of a later version, or would unpack to more bytes than splats ever do raises
    `InvalidPointsError`.
    """
    with open(path, "rb") as file:
        unpacked = _Unpacked(file)
        header = _read_header(unpacked.read(_HEADER.size), path)
        widths = header.widths
        length, size = header.count * sum(widths), os.fstat(file.fileno()).st_size
        if unpacks_too_far(length, size):
            raise InvalidPointsError(
                f"{path} would unpack to {length / 1e6:,.0f} MB from {size / 1e6:,.1f} MB, which splats never do. Copy"
                " or export it again."
            )
        data = unpacked.read(length)
    if len(data) < length:
        raise InvalidPointsError(
            f"{path} ends after {len(data):,} of the {length:,} bytes of its {header.count} splats. Copy or export it"
            " again."
        )
    ends = header.count * np.cumsum(widths)
    parts = np.split(np.frombuffer(data, np.uint8), ends[:-1])
    columns = _decode(header, *(part.reshape(header.count, width) for part, width in zip(parts, widths, strict=True)))
    notices = []
    if header.flags & _EXTENDED:
        notices.append(f"{path.name}: ignored vendor extensions, which may define other coordinate axes.")
    return PlyVertices(columns, "<", [], notices)


class _Unpacked:
    """The contents of a file, decompressed by gzip if need be, as far as requested."""

    def __init__(self, file: BinaryIO) -> None:
        packed = file.read(len(GZIP)) == GZIP
        file.seek(0)
        self._file, self._unpacker = file, zlib.decompressobj(wbits=zlib.MAX_WBITS | 16) if packed else None

    def read(self, count: int) -> bytearray | bytes:
        """Return the next bytes, fewer at the end of the file; memory is allocated for existing bytes only."""
        if self._unpacker is None:
            return self._file.read(min(count, os.fstat(self._file.fileno()).st_size))
        result, more = bytearray(), True
        while more and len(result) < count and not self._unpacker.eof:
            block = self._unpacker.unconsumed_tail or self._file.read(_BLOCK)
            data = self._unpacker.decompress(block, count - len(result))
            result += data
            more = bool(block or data)
        return result


def _read_header(data: bytearray | bytes, path: Path) -> _Header:
    header = _Header(*_HEADER.unpack(data)) if len(data) == _HEADER.size else None
    if header is None or header.magic != MAGIC:
        raise InvalidPointsError(f"{path} is no .spz file: it does not begin with NGSP. Copy or export it again.")
    if not 1 <= header.version <= _NEWEST:
        raise InvalidPointsError(
            f"{path} is an .spz file of version {header.version}, and only 1 to {_NEWEST} are read: later ones are"
            f" packed by Zstandard. Save it as version {_NEWEST}, or as PLY."
        )
    if not header.count:
        raise InvalidPointsError(f"{path} has no splats. Give a file with splats.")
    if header.degree >= len(COUNTS) or header.fraction > 24:
        raise InvalidPointsError(
            f"{path} has harmonics of degree {header.degree} and {header.fraction} bits behind the point, which no .spz"
            " file has. Copy or export it again."
        )
    return header


def _decode(
    header: _Header, places: Ints, opacities: Ints, colors: Ints, sizes: Ints, rotations: Ints, harmonics: Ints
) -> dict[str, Array]:
    """Return the columns of bytes, (n, k) each."""
    return {
        **split(PLACES, _decode_places(header, places)),
        **split(COLORS, (colors / 255.0 - 0.5) / _COLORS),
        **split(rest_names(COUNTS[header.degree], COUNTS[header.degree]), _decode_harmonics(header, harmonics)),
        OPACITY: encode_opacities(opacities[:, 0] / 255.0).astype(np.float32),
        **split(SCALES, sizes / 16.0 - 10.0),
        **split(ROTATIONS, _decode_rotations(header, rotations)),
    }


def _decode_places(header: _Header, data: Ints) -> Floats:
    """Return coordinates of numbers of 24 bits with a fixed point, or of 16 with a floating one in version 1."""
    if header.version == 1:
        return np.ascontiguousarray(data).view("<f2").astype(np.float64)
    padded = np.zeros((header.count, 3, 4), np.uint8)
    padded[:, :, 1:] = data.reshape(header.count, 3, 3)
    return (padded.view("<i4")[:, :, 0] >> 8) / 2.0**header.fraction


def _decode_rotations(header: _Header, data: Ints) -> Floats:
    """Return unit quaternions w x y z of x y z, or from version 3 on of all but the largest number."""
    if header.version <= _BEFORE_SMALLEST_THREE:
        vector = data / 127.5 - 1.0
        return completed_quaternions(np.zeros(header.count, int), vector)
    packed = np.ascontiguousarray(data).view("<u4")[:, 0]
    largest = (packed >> np.uint32(30)).astype(int)
    numbers = np.stack([packed >> np.uint32(shift) for shift in (20, 10, 0)], axis=1)
    sizes = (numbers & 511) / 511.0 * np.sqrt(0.5)
    found = completed_quaternions(largest, np.where(numbers & 512, -sizes, sizes))  # in the order x y z w
    return found[:, [3, 0, 1, 2]]


def _decode_harmonics(header: _Header, data: Ints) -> Array:
    """Return harmonics channel by channel, of bytes with the channels of each after one another."""
    values = (data.astype(np.float32) - 128.0) / 128.0
    return values.reshape(header.count, COUNTS[header.degree], 3).swapaxes(1, 2).reshape(header.count, -1)
