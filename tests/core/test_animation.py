"""Animated PNG files of the manual: what a reader of the format finds in them."""

import struct
import zlib

import numpy as np

from animation import write_loop, write_still


def chunks(data):
    """Kinds and contents of all chunks, whose checksums are right."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    place = 8
    while place < len(data):
        (length,) = struct.unpack(">I", data[place : place + 4])
        kind, content = data[place + 4 : place + 8], data[place + 8 : place + 8 + length]
        assert struct.unpack(">I", data[place + 8 + length : place + 12 + length]) == (zlib.crc32(kind + content),)
        yield kind, content
        place += 12 + length


def played(path):
    """Return the frames that are seen, (frames, height, width, 3), and the delay in seconds."""
    frames, number = [], 0
    for kind, content in chunks(path.read_bytes()):
        if kind == b"IHDR":
            width, height, *how = struct.unpack(">IIBBBBB", content)
            assert how == [8, 3, 0, 0, 0]
        elif kind == b"acTL":
            count, plays = struct.unpack(">II", content)
            assert plays == 0
        elif kind == b"PLTE":
            palette = np.frombuffer(content, np.uint8).reshape(-1, 3)
            assert len(palette) <= 64
        elif kind == b"fcTL":
            first, w, h, x, y, delay, unit, dispose, over = struct.unpack(">IIIIIHHBB", content)
            assert (first, dispose) == (number, 0)
            number += 1
        elif kind in (b"IDAT", b"fdAT"):
            if kind == b"fdAT":
                assert struct.unpack(">I", content[:4]) == (number,)
                content, number = content[4:], number + 1
            rows = np.frombuffer(zlib.decompress(content), np.uint8).reshape(h, w + 1)
            assert not rows[:, 0].any()
            shown = frames[-1].copy() if frames else np.zeros((height, width, 3), np.uint8)
            index = rows[:, 1:]
            part = shown[y : y + h, x : x + w]
            part[index > 0] = palette[index[index > 0]]
            assert over or (index > 0).all()
            frames.append(shown)
    assert len(frames) == count
    return np.array(frames), delay / unit


def test_few_colors_are_kept_as_they_are(tmp_path):
    rng = np.random.default_rng(0)
    colors = np.array([[16 * a, 255 - 24 * a, 40 * (a % 6)] for a in range(10)], np.uint8)
    stills = np.repeat(colors[rng.integers(10, size=(1, 20, 30))], 6, axis=0)
    stills[2:, 5:9, 7:12] = colors[3]
    stills[4, 0, 0], stills[5, -1, -1] = colors[1], colors[2]
    write_loop(tmp_path / "a.png", stills, 80)
    frames, delay = played(tmp_path / "a.png")
    np.testing.assert_array_equal(frames, stills)
    assert delay == 0.08


def test_many_colors_are_near_those_of_the_palette_and_what_stays_takes_nothing(tmp_path):
    across, up = np.meshgrid(np.linspace(0.0, 1.0, 80), np.linspace(0.0, 1.0, 60))
    base = np.stack([255.0 * across, 255.0 * up, 128.0 + 0.0 * up], axis=2).astype(np.uint8)
    write_loop(tmp_path / "a.png", base[None], 80)
    frames, _ = played(tmp_path / "a.png")
    assert np.abs(frames[0].astype(int) - base).mean() < 12.0
    write_loop(tmp_path / "b.png", np.repeat(base[None], 24, axis=0), 80)
    assert (tmp_path / "b.png").stat().st_size < (tmp_path / "a.png").stat().st_size + 24 * 100


def still(path):
    """Decode a single picture, (height, width, 3)."""
    found = dict(chunks(path.read_bytes()))
    assert list(found) == [b"IHDR", b"PLTE", b"IDAT", b"IEND"]
    width, height, *how = struct.unpack(">IIBBBBB", found[b"IHDR"])
    assert how == [8, 3, 0, 0, 0]
    palette = np.frombuffer(found[b"PLTE"], np.uint8).reshape(-1, 3)
    rows = np.frombuffer(zlib.decompress(found[b"IDAT"]), np.uint8).reshape(height, width + 1)
    assert not rows[:, 0].any()
    return palette[rows[:, 1:]], len(palette)


def test_a_picture_of_few_colors_is_kept_as_it_is(tmp_path):
    rng = np.random.default_rng(0)
    colors = np.unique(rng.integers(64, size=(200, 3)) * 4, axis=0).astype(np.uint8)
    picture = colors[rng.integers(len(colors), size=(30, 40))]
    write_still(tmp_path / "still.png", picture, 255)
    shown, _ = still(tmp_path / "still.png")
    np.testing.assert_array_equal(shown, picture)


def test_a_picture_of_many_colors_gets_the_nearest_of_few(tmp_path):
    x, y = np.meshgrid(np.linspace(0.0, 255.0, 64), np.linspace(0.0, 255.0, 64))
    picture = np.stack([x, y, 0.5 * (x + y)], axis=-1).astype(np.uint8)
    errors = []
    for colors in (16, 64, 255):
        write_still(tmp_path / "still.png", picture, colors)
        shown, found = still(tmp_path / "still.png")
        assert found <= colors + 1
        errors.append(np.sqrt(np.mean((shown.astype(float) - picture) ** 2)))
    # On a plane of colors, as the cells of a grid of 255 / sqrt(count): halving these halves the error.
    np.testing.assert_allclose(np.divide(errors[0], errors[1:]), [2.0, 4.0], rtol=0.3)
