"""The E57 files beside this, by formulas that tests know, too: run it in an environment that has pye57 to make them.

pip install pye57
python -m tests.core.data.make_e57
"""

from pathlib import Path

import numpy as np

COUNT = 300
_I = np.arange(COUNT)
_POSE = ((0.5, 0.5, 0.5, 0.5), (446_000.125, 4_000_000.25, 120.5))  # x to y to z to x, and a place
_TURN = ((0.8, 0.0, 0.0, 0.6), (10.0, -20.0, 1.5))  # about z, by the angle whose cosine is 0.28

# Of each file its scans: of each field the kind, limits with scale and offset, and values as they are stored; the pose.
FILES = {
    "single": [
        (
            {
                "cartesianX": ("single", None, (0.25 * _I).astype(np.float32)),
                "cartesianY": ("single", None, (-0.1 * _I).astype(np.float32)),
                "cartesianZ": ("single", None, np.sin(_I).astype(np.float32)),
                "intensity": ("single", None, (_I / COUNT).astype(np.float32)),
                "colorRed": ("integer", (0, 255), _I % 256),
                "colorGreen": ("integer", (0, 255), 7 * _I % 256),
                "colorBlue": ("integer", (0, 255), 255 - _I % 256),
                "rowIndex": ("integer", (0, 19), _I // 15),
                "columnIndex": ("integer", (0, 14), _I % 15),
            },
            None,
        )
    ],
    "scaled": [
        (
            {
                "cartesianX": ("scaled", (-70_000, 70_000, 0.001, 5.0), 97 * _I - 14_000),
                "cartesianY": ("scaled", (0, 2**33, 2.0**-20, -3.0), 28_633_115 * _I),
                "cartesianZ": ("scaled", (-(2**40), 2**52, 0.5, 0.0), _I**5),
                "cartesianInvalidState": ("integer", (0, 2), np.where(_I % 10 < 8, 0, _I % 10 - 7)),
                "intensity": ("integer", (-5, 2000), 6 * _I - 5),
                "colorRed": ("integer", (0, 1023), 3 * _I),
                "colorGreen": ("integer", (0, 1023), 1023 - 3 * _I),
                "colorBlue": ("integer", (0, 1023), np.full(COUNT, 1023)),
                "returnCount": ("integer", (1, 1), np.ones(COUNT, np.int64)),
            },
            None,
        )
    ],
    "scans": [
        (
            {
                "cartesianX": ("double", None, np.sqrt(_I)),
                "cartesianY": ("double", None, np.cos(_I)),
                "cartesianZ": ("double", None, _I / 3.0),
                "nor:normalX": ("single", None, np.cos(_I).astype(np.float32)),
                "nor:normalY": ("single", None, np.sin(_I).astype(np.float32)),
                "nor:normalZ": ("single", None, np.zeros(COUNT, np.float32)),
            },
            _POSE,
        ),
        (
            {
                "cartesianX": ("double", None, 0.5 * _I[:100]),
                "cartesianY": ("double", None, 2.0 - _I[:100]),
                "cartesianZ": ("double", None, np.ones(100)),
                "intensity": ("integer", (0, 127), _I[:100]),
            },
            _TURN,
        ),
    ],
    "spherical": [
        (
            {
                "sphericalRange": ("double", None, 1.0 + _I / 100.0),
                "sphericalAzimuth": ("single", None, np.linspace(-3.0, 3.0, COUNT).astype(np.float32)),
                "sphericalElevation": ("scaled", (-1500, 1500, 0.001, 0.0), 10 * _I - 1495),
                "sphericalInvalidState": ("integer", (0, 2), _I % 3),
                "timeStamp": ("double", None, 0.001 * _I),
            },
            (_TURN[0], (0.0, 0.0, 0.0)),
        )
    ],
}


def write(path, scans):
    """Write scans as libE57Format does."""
    from pye57 import E57, libe57

    file = E57(str(path), mode="w")
    image = file.image_file
    image.extensionsAdd("nor", "http://www.libe57.org/E57_NOR_surface_normals.txt")

    def structure(values):
        node = libe57.StructureNode(image)
        for name, value in values.items():
            node.set(name, value if not isinstance(value, float) else libe57.FloatNode(image, value))
        return node

    for fields, pose in scans:
        scan = structure({"guid": libe57.StringNode(image, f"{len(file.data3d)}")})
        if pose:
            rotation, translation = (
                dict(zip(names, part, strict=True)) for names, part in zip(("wxyz", "xyz"), pose, strict=True)
            )
            scan.set("pose", structure({"rotation": structure(rotation), "translation": structure(translation)}))
        prototype, buffers, arrays = libe57.StructureNode(image), libe57.VectorSourceDestBuffer(), []
        for name, (kind, limits, values) in fields.items():
            match kind:
                case "single" | "double":
                    precision = libe57.E57_SINGLE if kind == "single" else libe57.E57_DOUBLE
                    node = libe57.FloatNode(image, 0.0, precision)
                case "integer":
                    node = libe57.IntegerNode(image, limits[0], *limits)
                case "scaled":
                    node = libe57.ScaledIntegerNode(image, 0, *limits)
            prototype.set(name, node)
            arrays.append(np.array(values, np.float64))  # of other types pye57 takes a few only
            buffers.append(libe57.SourceDestBuffer(image, name, arrays[-1], len(values), True, False))
        points = libe57.CompressedVectorNode(image, prototype, libe57.VectorNode(image, True))
        scan.set("points", points)
        file.data3d.append(scan)
        writer = points.writer(buffers)
        writer.write(len(arrays[0]))
        writer.close()
    file.close()


if __name__ == "__main__":
    for name, scans in FILES.items():
        write(Path(__file__).with_name(f"{name}.e57"), scans)
