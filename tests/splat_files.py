"""Writers of files of Gaussian splats, one splat after another from what is published about each kind, not by core."""

import gzip
import struct

import numpy as np

CONSTANT = 0.28209479177387814
PROPERTIES = ("x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2")
PROPERTIES += ("rot_0", "rot_1", "rot_2", "rot_3")
CHUNK = ("x", "y", "z", "scale_x", "scale_y", "scale_z", "r", "g", "b")


def some_columns(count=300, harmonics=0, seed=5):
    """Columns as trainers write them, with numbers that all kinds of files can hold."""
    rng = np.random.default_rng(seed)
    columns = {name: rng.uniform(-3.0, 3.0, count) for name in "xyz"}
    columns |= {f"f_dc_{channel}": rng.uniform(-1.7, 1.7, count) for channel in range(3)}
    columns |= {f"f_rest_{number}": rng.uniform(-0.9, 0.9, count) for number in range(3 * harmonics)}
    columns["opacity"] = rng.uniform(-4.0, 4.0, count)
    columns |= {f"scale_{axis}": rng.uniform(-7.0, 0.0, count) for axis in range(3)}
    turns = rng.standard_normal((count, 4))
    turns /= np.linalg.norm(turns, axis=1)[:, None]
    columns |= {f"rot_{number}": turns[:, number] for number in range(4)}
    return {name: values.astype(np.float32) for name, values in columns.items()}


def write_ply(path, columns, comments=()):
    """Write columns, in their types, as little-endian PLY."""
    names = {"f4": "float", "f8": "double", "u1": "uchar", "u4": "uint", "i4": "int"}
    rows = np.empty(len(columns["x"]), [(name, values.dtype) for name, values in columns.items()])
    for name, values in columns.items():
        rows[name] = values
    head = ["ply", "format binary_little_endian 1.0", *comments, f"element vertex {len(rows)}"]
    head += [f"property {names[values.dtype.str[1:]]} {name}" for name, values in columns.items()]
    path.write_bytes("\n".join([*head, "end_header\n"]).encode() + rows.tobytes())


def rows_of(columns):
    """Return a splat a row: place, constant harmonics, opacity, sizes, rotation w x y z."""
    for numbers in np.stack([columns[name] for name in PROPERTIES], axis=1).astype(float):
        *rest, opacity = numbers[:7]
        yield rest[:3], rest[3:], 1.0 / (1.0 + np.exp(-opacity)), numbers[7:10], numbers[10:]


def byte(value):
    return int(min(max(round(value), 0), 255))


def make_splat(columns):
    """Make a .splat file."""
    data = b""
    for place, color, opacity, sizes, turn in rows_of(columns):
        data += struct.pack("<6f", *place, *np.exp(sizes))
        data += bytes([*(byte(255 * (0.5 + CONSTANT * c)) for c in color), byte(255 * opacity)])
        data += bytes(byte(128 + 128 * t) for t in turn)
    return data


def make_spz(columns, version=3, flags=0, fraction=12, pack=gzip.compress, **header):
    """Make an .spz file of a version up to 3."""
    per_channel = sum(name.startswith("f_rest_") for name in columns) // 3
    degree = round(np.sqrt(per_channel + 1)) - 1
    planes = [b""] * 6
    for number, (place, color, opacity, sizes, (w, x, y, z)) in enumerate(rows_of(columns)):
        if version == 1:
            planes[0] += struct.pack("<3e", *place)
        else:
            for value in place:
                planes[0] += (round(value * 2**fraction) % 2**24).to_bytes(3, "little")
        planes[1] += bytes([byte(255 * opacity)])
        planes[2] += bytes(byte(255 * (0.5 + 0.15 * c)) for c in color)
        planes[3] += bytes(byte(16 * (size + 10)) for size in sizes)
        planes[4] += smallest_three(x, y, z, w) if version > 2 else first_three(w, x, y, z)
        for k in range(per_channel):
            for channel in range(3):
                value = columns[f"f_rest_{channel * per_channel + k}"][number]
                planes[5] += bytes([byte(128 + 128 * value)])
    head = {"magic": b"NGSP", "version": version, "count": len(columns["x"]), "degree": degree, **header}
    return pack(struct.pack("<4sIIBBBB", *head.values(), fraction, flags, 0) + b"".join(planes))


def first_three(w, x, y, z):
    side = 1.0 if w >= 0.0 else -1.0
    return bytes(byte(127.5 + 127.5 * side * value) for value in (x, y, z))


def smallest_three(*numbers):
    """The largest number's place in two bits, and of the others a sign and nine bits each."""
    largest = max(range(4), key=lambda i: abs(numbers[i]))
    packed = largest
    for i in range(4):
        if i != largest:
            negative = int((numbers[i] < 0.0) != (numbers[largest] < 0.0))
            packed = packed << 10 | negative << 9 | int(511 * abs(numbers[i]) * np.sqrt(2.0) + 0.5)
    return packed.to_bytes(4, "little")


def make_packed(columns, with_colors=True):
    """Make a packed PLY file as SuperSplat does, with harmonics by bytes."""
    splats = [[*p, *s, *(0.5 + CONSTANT * np.array(c)), o, *t] for p, c, o, s, t in rows_of(columns)]
    chunks, vertices = b"", b""
    for first in range(0, len(splats), 256):
        part = splats[first : first + 256]
        low, high = np.min(part, axis=0)[:9].astype("<f4"), np.max(part, axis=0)[:9].astype("<f4")
        if not with_colors:
            low[6:], high[6:] = 0.0, 1.0
        axes = ((0, 3), (3, 6), (6, 9)) if with_colors else ((0, 3), (3, 6))
        chunks += b"".join(bound[slice(*axis)].tobytes() for axis in axes for bound in (low, high))
        for splat in part:
            shares = (np.array(splat[:9]) - low) / (high - low)
            vertices += struct.pack(
                "<4I",
                bits(shares[:3]),
                largest_and_others(splat[10:]),
                bits(shares[3:6]),
                four([*shares[6:], splat[9]]),
            )
    names = CHUNK if with_colors else CHUNK[:6]
    bounds = [f"{end}_{name}" for k in range(0, len(names), 3) for end in ("min", "max") for name in names[k : k + 3]]
    rest = [name for name in columns if name.startswith("f_rest_")]
    head = ["ply", "format binary_little_endian 1.0", f"element chunk {-(-len(splats) // 256)}"]
    head += [f"property float {name}" for name in bounds] + [f"element vertex {len(splats)}"]
    head += [f"property uint packed_{name}" for name in ("position", "rotation", "scale", "color")]
    if rest:
        head += [f"element sh {len(splats)}", *(f"property uchar {name}" for name in rest)]
    values = np.stack([columns[name] for name in rest], axis=1) if rest else np.empty((0, 0))
    harmonics = np.clip(np.floor(256 * (values / 8 + 0.5)), 0, 255).astype(np.uint8)
    return "\n".join([*head, "end_header\n"]).encode() + chunks + vertices + harmonics.tobytes()


def whole(share, width):
    return int(min(max(share, 0.0), 1.0) * (2**width - 1) + 0.5)


def bits(shares):
    x, y, z = shares
    return whole(x, 11) << 21 | whole(y, 10) << 11 | whole(z, 11)


def four(shares):
    r, g, b, a = (whole(share, 8) for share in shares)
    return r << 24 | g << 16 | b << 8 | a


def largest_and_others(turn):
    largest = int(np.argmax(np.abs(turn)))
    turn = np.array(turn) * np.sign(turn[largest])
    packed = largest
    for number in range(4):
        if number != largest:
            packed = packed << 10 | whole(turn[number] * np.sqrt(0.5) + 0.5, 10)
    return packed
