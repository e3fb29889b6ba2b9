"""Cloud optimized point clouds to test with: an octree of chunks, written by the specification of COPC 1.0."""

import struct

import numpy as np

ENTRY = "<iiiiQii"


def sort_into_octree(points, low, edge, capacity):
    """Return the rows of points of each node by its key (level, x, y, z): so many at most, the rest in its children."""
    nodes, pending = {}, [((0, 0, 0, 0), np.arange(len(points)))]
    while pending:
        key, rows = pending.pop()
        nodes[key], rest = rows[:: max(len(rows) // capacity, 1)], rows
        rest = np.setdiff1d(rows, nodes[key])
        level = key[0] + 1
        cells = np.floor((points[rest] - low) * 2.0**level / edge).astype(int)
        for cell in np.unique(cells, axis=0):
            pending.append(((level, *cell.tolist()), rest[(cells == cell).all(axis=1)]))
    return nodes


def write_copc(path, points, capacity=20, pages=False, change=lambda entries: entries):
    """Write points, with their numbers as intensities, and return the level of each.

    Parameters
    ----------
    path : pathlib.Path
    points : ndarray, (n, 3)
    capacity : int
        Points of a node, about.
    pages : bool
        Whether each child of the root has a page of its own, with all below.
    change : callable
        Changes the entries of nodes before they are written: tuples of level, x, y, z, place, bytes, and points.
    """
    import laspy  # which in Blender comes with the extension
    import lazrs

    las = laspy.LasData(laspy.LasHeader(point_format=6, version="1.4"))
    las.header.offsets, las.header.scales = points.min(axis=0), np.full(3, 0.001)
    las.x, las.y, las.z = points.T
    las.intensity, las.classification = np.arange(len(points)), np.arange(len(points)) % 5
    plain = path.with_suffix(".plain.las")
    las.write(str(plain))
    data = plain.read_bytes()
    plain.unlink()
    (begin,) = struct.unpack_from("<I", data, 96)
    size = las.header.point_format.size
    records = np.frombuffer(data[begin:], np.uint8).reshape(-1, size)
    low, edge = points.min(axis=0), float(np.ptp(points, axis=0).max()) * 1.001
    nodes = sort_into_octree(points, low, edge, capacity)
    packing = lazrs.LazVlr.new_for_compression(6, 0, True)
    details = [struct.pack("<H16sHH32s", 0, b"laszip encoded", 22204, len(packing.record_data()), b"")]
    details.append(packing.record_data())
    start = 375 + 54 + 160 + sum(map(len, details))
    head = bytearray(data[:375])
    struct.pack_into("<I", head, 96, start)
    struct.pack_into("<I", head, 100, 2)
    head[104] |= 0x80  # compressed
    with open(path, "w+b") as file:
        file.write(bytes(start))
        file.seek(start)
        packer = lazrs.LasZipCompressor(file, packing)
        counts = []
        for rows in nodes.values():
            packer.compress_many(records[rows].tobytes())
            packer.finish_current_chunk()
            counts.append(len(rows))
        packer.done()
        file.seek(start)
        lengths = [length for _, length in lazrs.read_chunk_table(file, packing)]
        places = start + 8 + np.cumsum([0, *lengths[:-1]])
        entries = [
            (*key, int(place), length, count)
            for key, place, length, count in zip(nodes, places, lengths, counts, strict=False)
        ]
        entries = change(entries)
        file.seek(0, 2)
        parts = {}
        for entry in entries:
            cell = tuple(number >> (entry[0] - 1) for number in entry[1:4]) if entry[0] and pages else ()
            parts.setdefault(cell, []).append(entry)
        root = parts.pop(())
        for cell, page in parts.items():
            root.append((1, *cell, file.tell(), 32 * len(page), -1))
            file.write(b"".join(struct.pack(ENTRY, *entry) for entry in page))
        place = file.tell()
        file.write(b"".join(struct.pack(ENTRY, *entry) for entry in root))
        octree = struct.pack("<5d2Q2d", *(low + 0.5 * edge), 0.5 * edge, 0.1 * edge, place, 32 * len(root), 0.0, 0.0)
        file.seek(0)
        file.write(bytes(head))
        file.write(struct.pack("<H16sHH32s", 0, b"copc", 1, 160, b"") + octree.ljust(160, b"\0") + b"".join(details))
    levels = np.empty(len(points), int)
    for (level, *_), rows in nodes.items():
        levels[rows] = level
    return levels
