"""The bytes of E57 files: pages with checksums, sections of packets, and in them numbers of any bits."""

import os
import struct
from functools import cache
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..errors import InvalidPointsError
from ..types import Array, Ints
from .rows import too_short

PAGE = 1024  # bytes ...
_BODY = 1020  # ... and those before the checksum
_BLOCK = 4096  # pages that are read at once
_SECTION = "<B7xQQ8x"  # kind, length, place of the first packet
_PACKET = "<BxHH"  # kind, length less one, number of streams
_POINTS, _INDEX, _VALUES, _EMPTY = 1, 0, 1, 2  # kinds of sections and of packets


def place_of(offset: int) -> int:
    """Return how many bytes lie before an offset in the file if checksums are not counted."""
    page, rest = divmod(offset, PAGE)
    if page < 0 or rest >= _BODY:
        raise ValueError(f"nothing can begin at its byte {offset}")
    return page * _BODY + rest


def read_bytes(file: BinaryIO, place: int, count: int, path: Path) -> Ints:
    """Read so many bytes of an open file from a place on, both without checksums, which are compared.

    A file that ends before, or has changed since it was written, raises `InvalidPointsError`.
    """
    first, last = place // _BODY, -(-(place + count) // _BODY)
    if last * PAGE > os.fstat(file.fileno()).st_size:
        raise InvalidPointsError(f"{path} is shorter than its header states. Copy it again.")
    result = np.empty((last - first, _BODY), np.uint8)
    file.seek(first * PAGE)
    for row in range(0, len(result), _BLOCK):
        rows = result[row : row + _BLOCK]
        pages = np.fromfile(file, np.uint8, len(rows) * PAGE).reshape(-1, PAGE)
        wrong = np.flatnonzero(_checksums(pages) != pages.view(">u4")[:, -1])
        if len(wrong):
            raise InvalidPointsError(
                f"{path} is broken: the checksum of its page {first + row + wrong[0] + 1} of {PAGE} bytes does not"
                " match. Copy it again."
            )
        rows[:] = pages[:, :_BODY]
    return result.reshape(-1)[place - first * _BODY :][:count]


def _checksums(pages: Ints) -> Ints:
    """Return the CRC-32C of each page: of all at once, two bytes at a time."""
    table, sums = _crc_table(), np.full(len(pages), 0xFFFFFFFF, np.int64)
    for words in pages.view("<u2").T[: _BODY // 2].astype(np.int64):
        sums = table[(sums ^ words) & 0xFFFF] ^ (sums >> 16)
    return sums ^ 0xFFFFFFFF


@cache
def _crc_table() -> Ints:
    """Return the CRC-32C of each two bytes, (65536,)."""
    table = np.arange(2**16)
    for _ in range(16):
        table = (table >> 1) ^ np.where(table & 1, 0x82F63B78, 0)
    return table


def read_streams(file: BinaryIO, place: int, end: float, widths: list[int], count: int, path: Path) -> list[Array]:
    """Read the values of points, field by field, from the packets that they are divided among.

    Parameters
    ----------
    file : file object
    place, end : int
        Of the section of the points, without checksums; it ends there at the latest.
    widths : list of int
        Bits of a value of each field; those of 0 are left out.
    count : int
        How many points there are; a shorter section is refused before there is memory for them.
    path : pathlib.Path
        The file, for the texts of errors.

    Returns
    -------
    list of ndarray, (m,) uint8
        As `unpack` takes them.
    """
    kind, length, first = struct.unpack(_SECTION, read_bytes(file, place, struct.calcsize(_SECTION), path))
    begin = place_of(first)
    if kind != _POINTS or not place < begin <= place + length <= end:
        raise ValueError("it has no points at the offset that it states")
    data = read_bytes(file, begin, place + length - begin, path)
    needed = [-(-count * width // 8) for width in widths]
    if sum(needed) > len(data):
        raise too_short(path, 8 * len(data) // sum(widths), count)
    streams = [np.zeros(-(-count // 8) * width + 9, np.uint8) for width in widths]
    filled, head = [0] * len(widths), struct.calcsize(_PACKET)
    place = 0
    while filled != needed:
        if place + head > len(data):
            found = min(8 * size // width for size, width in zip(filled, widths, strict=True) if width)
            raise too_short(path, found, count)
        kind, length, number = struct.unpack_from(_PACKET, data, place)
        behind, at = place + length + 1, place + head + 2 * number
        if kind not in (_INDEX, _VALUES, _EMPTY) or behind % 4 or behind > len(data):
            raise ValueError("the packets of its points are invalid")
        if kind == _VALUES:
            sizes = data[place + head : at].view("<u2").tolist() if at <= behind else []
            if len(sizes) != len(widths) or at + sum(sizes) > behind:
                raise ValueError("a data packet does not match its header")
            for index, size in enumerate(sizes):
                values = data[at : at + min(size, needed[index] - filled[index])]
                streams[index][filled[index] : filled[index] + len(values)] = values
                filled[index] += len(values)
                at += size
        place = behind
    return streams


def unpack(stream: Ints, width: int, count: int) -> Ints:
    """Return whole numbers of so many bits each, up to 64, the lowest bit first, (count,) uint64.

    Eight numbers lie in as many bytes of the stream as one has bits; nine bytes more are there than those of all
    eights.
    """
    result = np.empty((-(-count // 8), 8), np.uint64)
    for index in range(8):
        place, shift = divmod(index * width, 8)
        column = np.ndarray(len(result), "<u8", stream, place, (width,)) >> np.uint64(shift)
        if shift + width > 64:
            rest = np.ndarray(len(result), np.uint8, stream, place + 8, (width,))
            column |= rest.astype(np.uint64) << np.uint64(64 - shift)
        result[:, index] = column & np.uint64(2**width - 1)
    return result.reshape(-1)[:count]
