"""PNG files of few colors: single pictures, and animations, which other programs show as their first frame."""

import struct
import zlib

import numpy as np

COLORS = 63  # of animations, and one that stands for what stays as it was
_ROUNDS = 12  # of moving colors of the palette to the middle of those that they stand for
_BITS = 5  # of each channel that colors of animations are counted by
_FINE_BITS = 6  # the same for single pictures


def write_loop(path, stills, delay):
    """Write pictures as an animation that runs forever.

    Parameters
    ----------
    path : pathlib.Path
    stills : ndarray, (frames, height, width, 3) uint8
    delay : int
        Milliseconds from one to the next.
    """
    count, height, width, _ = stills.shape
    palette, index = _quantized(stills, COLORS, _BITS)
    parts = [
        _header(width, height),
        _chunk(b"acTL", struct.pack(">II", count, 0)),
        _chunk(b"PLTE", bytes(3) + palette.tobytes()),
        _chunk(b"tRNS", b"\0"),
    ]
    number = 0
    for frame in range(count):
        shown, place = _changed(index, frame)
        control = struct.pack(">IIIIIHHBB", number, *shown.shape[::-1], *place[::-1], delay, 1000, 0, 1 if frame else 0)
        parts.append(_chunk(b"fcTL", control))
        number += 1
        data = _packed(shown)
        if frame:
            parts.append(_chunk(b"fdAT", struct.pack(">I", number) + data))
            number += 1
        else:
            parts.append(_chunk(b"IDAT", data))
    _write(path, parts)


def write_still(path, picture, colors):
    """Write a picture in few colors.

    Parameters
    ----------
    path : pathlib.Path
    picture : ndarray, (height, width, 3) uint8
    colors : int
        How many, at most 255.
    """
    palette, index = _quantized(picture[None], colors, _FINE_BITS)
    place = _chunk(b"PLTE", bytes(3) + palette.tobytes())
    _write(path, [_header(*picture.shape[1::-1]), place, _chunk(b"IDAT", _packed(index[0]))])


def _header(width, height):
    return _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0))


def _packed(index):
    """Places in the palette, (height, width), as a file holds them: no row is filtered."""
    return zlib.compress(np.concatenate([np.zeros((len(index), 1), np.uint8), index], axis=1).tobytes(), 9)


def _write(path, parts):
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts) + _chunk(b"IEND", b""))


def _chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _changed(index, frame):
    """Return the part of a frame that differs from the one before, 0 where it does not, and its row and column."""
    if not frame:
        return index[0], (0, 0)
    changed = index[frame] != index[frame - 1]
    rows, columns = (np.flatnonzero(changed.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        rows = columns = np.zeros(1, int)
    part = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    return np.where(changed, index[frame], 0)[part].astype(np.uint8), (rows[0], columns[0])


def _quantized(stills, colors, bits):
    """Return a palette, (k, 3) uint8, and for each pixel the place of its color in it, from 1 (k-means)."""
    codes = (stills >> (8 - bits)).astype(np.int64) @ [1 << (2 * bits), 1 << bits, 1]
    _, of_bin, counts = np.unique(codes.ravel(), return_inverse=True, return_counts=True)
    means = np.stack([np.bincount(of_bin, channel) for channel in stills.reshape(-1, 3).T], axis=1) / counts[:, None]
    weights = np.sqrt(counts)  # so that small areas keep their colors
    palette = means[_apart(means, weights, colors)]
    for _ in range(_ROUNDS):
        nearest = _nearest(means, palette)
        total = np.bincount(nearest, weights, len(palette))
        sums = np.stack([np.bincount(nearest, weights * channel, len(palette)) for channel in means.T], axis=1)
        palette = np.where(total[:, None] > 0.0, sums / np.maximum(total, 1e-300)[:, None], palette)
    palette = np.rint(palette).astype(np.uint8)
    nearest = _nearest(means, palette.astype(float))
    return palette, (1 + nearest[of_bin]).reshape(stills.shape[:3]).astype(np.uint8)


def _apart(colors, weights, count):
    """Return some rows of colors to begin with: the most frequent one, then each the farthest from those before."""
    chosen, away = [int(weights.argmax())], np.full(len(colors), np.inf)
    while len(chosen) < min(count, len(colors)):
        away = np.minimum(away, np.sum((colors - colors[chosen[-1]]) ** 2, axis=1))
        chosen.append(int((away * weights).argmax()))
    return chosen


def _nearest(colors, palette):
    return np.argmin(np.sum((colors[:, None] - palette) ** 2, axis=2), axis=1)
