"""LAS files of all point formats for tests, with a number of its own in each column."""

import struct
from datetime import date
from uuid import UUID

import laspy
import numpy as np

WKT = 'PROJCS["ETRS89 / UTM zone 32N",GEOGCS["ETRS89"],UNIT["metre",1],AUTHORITY["EPSG","25832"]]'
KEYS = struct.pack("<12H", 1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 25832)
WAVEFORMS = {4: 1, 5: 3, 9: 6, 10: 8}  # point formats, and those without
PLACE = np.array([445_000.0, 5_550_000.0, 210.0])
RECORDS = (  # beside the coordinate system
    ("LASF_Spec", 0, b"names of classes", bytes([2]) + b"Ground".ljust(15)),
    ("LASF_Spec", 3, b"", b"a survey"),
    ("someone", 7, "Höhe".encode("latin-1"), bytes(range(256))),
)
STATED = {
    "file_source_id": 17,
    "system_identifier": "Gerät 1".encode("latin-1"),
    "creation_date": date(2020, 2, 29),
    "uuid": UUID(int=12345),
}


def write_all(path, kind, side=14, full=65535, withheld=False, wkt=WKT, scale=0.001, time=1, begin=None):
    """Write a wavy ground of a point format with all columns and extra bytes, and return what laspy reads of it."""
    rng = np.random.default_rng(kind)
    x, y = (0.25 * (axis.ravel() + rng.uniform(-0.2, 0.2, side**2)) for axis in np.mgrid[:side, :side])
    version = ("1.4" if kind > 5 else "1.3" if kind > 3 else "1.2") if begin is None else "1.5"
    header = laspy.LasHeader(point_format=kind, version=version)
    header.scales, header.offsets = np.array([scale, scale, 0.5 * scale]), PLACE + 0.0005
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType(time)
    header.global_encoding.wkt = kind > 5
    number, data = (2112, wkt.encode() + b"\0") if kind > 5 else (34735, KEYS)
    header.vlrs.extend([laspy.VLR("LASF_Projection", number, "a system", data)] if wkt else [])
    header.vlrs.extend(laspy.VLR(*record) for record in RECORDS)
    for name, value in STATED.items():
        setattr(header, name, value)
    if begin is not None:
        header.global_encoding.gps_time_offset, header.gps_time_offset = True, begin
    header.add_extra_dims(
        [
            laspy.ExtraBytesParams("Deviation", "u2", "shape of the echo"),
            laspy.ExtraBytesParams("Amplitude", "i2", "in dB", offsets=[10.0], scales=[0.01], no_data=[-1]),
            laspy.ExtraBytesParams("beam", "3f8", "where it came from"),
            laspy.ExtraBytesParams("odd\nname", "i4"),
            *(laspy.ExtraBytesParams(f"Normal{axis}", "f4") for axis in "XYZ"),
        ]
    )
    las = laspy.LasData(header)
    las.x, las.y, las.z = (np.column_stack([x, y, 0.3 * np.sin(x) * np.cos(y)]) + PLACE).T
    count = rng.integers(1, 6, side**2)
    for item in las.point_format.standard_dimensions:
        if item.name in (
            "intensity",
            "user_data",
            "point_source_id",
            "classification",
            "scan_angle",
            "scan_angle_rank",
        ):
            las[item.name] = rng.integers(max(item.min, -15_000), item.max + 1, side**2)
        elif item.num_bits < 3:
            las[item.name] = rng.integers(0, item.max + 1 if withheld or item.name != "withheld" else 1, side**2)
        elif item.name in ("red", "green", "blue", "nir"):
            las[item.name] = rng.integers(0, full + 1, side**2)
    las.number_of_returns, las.return_number = count, rng.integers(1, count + 1)
    if "gps_time" in las.point_format.dimension_names:
        las.gps_time = 3e8 + rng.random(side**2)
    las.Deviation = rng.integers(0, 200, side**2)
    las.Amplitude = 10.0 + rng.integers(-3000, 3000, side**2) / 100.0
    las.beam = rng.normal(size=(side**2, 3)).astype(np.float32)  # as many digits as Blender keeps
    las["odd\nname"] = rng.integers(-5, 5, side**2)
    las.NormalZ = np.ones(side**2)
    save(las, path)
    return laspy.read(path)


def save(las, path):
    """Write a file whose texts need not be ASCII, as laspy's own method wants them."""
    with laspy.open(str(path), "w", header=las.header, encoding_errors="ignore") as file:
        file.write_points(las.points)
        if las.evlrs:
            file.write_evlrs(las.evlrs)


def check_same(found, given, extra=()):
    """Check that a file has the columns of another one, in another order maybe, and what its header states."""
    kind = given.point_format.id
    assert found.point_format.id == WAVEFORMS.get(kind, kind)
    assert str(found.header.version) == str(given.header.version)
    order = [np.lexsort((las.Z, las.Y, las.X)) for las in (found, given)]
    for item in found.point_format.standard_dimensions:
        pair = [np.asarray(las[item.name])[rows] for las, rows in zip((found, given), order, strict=True)]
        np.testing.assert_array_equal(*pair, err_msg=item.name)
    lost = {*given.point_format.standard_dimension_names} - {*found.point_format.standard_dimension_names}
    waves = ("wavepacket", "return_point_wave", "x_t", "y_t", "z_t")
    assert all(name.startswith(waves) for name in lost)
    assert bool(lost) == (kind in WAVEFORMS)
    items = {item.name: item for item in found.point_format.extra_dimensions}
    for item in given.point_format.extra_dimensions:
        if item.name not in extra:
            assert items[item.name] == item
            pair = [np.asarray(las[item.name])[rows] for las, rows in zip((found, given), order, strict=True)]
            np.testing.assert_allclose(*pair, rtol=1e-12, err_msg=item.name)
    missing = [
        {item.format_name(): item.no_data for item in las.header.vlrs.get("ExtraBytesVlr")[0].extra_bytes_structs}
        for las in (found, given)
    ]
    assert missing[1]["Amplitude"] == [-1]
    assert missing[0].items() >= missing[1].items()
    np.testing.assert_array_equal(found.header.scales, given.header.scales)
    np.testing.assert_array_equal(found.header.offsets, given.header.offsets)
    assert found.header.global_encoding.value == given.header.global_encoding.value
    for number in ("WktCoordinateSystemVlr", "GeoKeyDirectoryVlr"):
        pair = [[record.record_data_bytes() for record in las.header.vlrs.get(number)] for las in (found, given)]
        assert pair[0] == pair[1]
    assert {name: getattr(found.header, name) for name in STATED} == STATED
    assert found.header.gps_time_offset == given.header.gps_time_offset
    assert records(found) == records(given) != []


def records(las):
    """Return the records of a file that are neither of its coordinate system nor of how points are stored."""
    others = [record for record in las.header.vlrs if record.user_id not in ("LASF_Projection", "laszip encoded")]
    found = [(record.user_id, record.record_id, record.description, record.record_data_bytes()) for record in others]
    return [record for record in found if record[:2] != ("LASF_Spec", 4)]
