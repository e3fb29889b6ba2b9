"""Units of length that LAS files state."""

import struct

import laspy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from core.files import LasChoices, chunks, extent, join_notices, read_points

PLACES = np.array([[637000.0, 849000.0, 400.0], [637010.0, 849000.0, 410.0], [637000.0, 849020.0, 420.0]])
SURVEY_FOOT = 1200.0 / 3937.0
BASE = 'GEOGCS["NAD83",DATUM["D",SPHEROID["GRS 1980",6378137,298.257]],UNIT["degree",0.0174532925199433]]'
US = 'UNIT["US survey foot",0.304800609601219,AUTHORITY["EPSG","9003"]]'


def plane(unit):
    lambert = 'PROJECTION["Lambert"],PARAMETER["false_easting",1312336]'
    return f'PROJCS["a (b) ""c"", d",{BASE},{lambert},{unit},AXIS["X",EAST]]'


def second(plane_unit, height_unit):
    base = 'BASEGEOGCRS["NAD83",DATUM["D",ELLIPSOID["GRS 1980",6378137,298.257,LENGTHUNIT["metre",1]]]]'
    conversion = 'CONVERSION["L",METHOD["M"],PARAMETER["Easting",400000,LENGTHUNIT["metre",1]]]'
    axes = f'CS[Cartesian,2],AXIS["easting (X)",east,ORDER[1],{plane_unit}],AXIS["northing",north,{plane_unit}]'
    heights = f'VERTCRS["h",VDATUM["v"],CS[vertical,1],AXIS["gravity-related height",up,{height_unit}]]'
    return f'COMPOUNDCRS["c",PROJCRS["p",{base},{conversion},{axes}],{heights}]'


FOOT_2, METER_2 = 'LENGTHUNIT["foot",0.3048]', 'LENGTHUNIT["metre",1]'
SYSTEMS = {
    "one unit": (plane(US), SURVEY_FOOT, SURVEY_FOOT, "coordinates are in US survey feet, and so are lengths"),
    "international": (
        plane('UNIT["Foot",0.3048]'),
        0.3048,
        0.3048,
        "LasChoices.meters converts them; in meters one is 0.3048.",
    ),
    "ESRI": (plane('UNIT["Foot_US",0.3048006096012192]'), SURVEY_FOOT, SURVEY_FOOT, "US survey feet"),
    "other": (plane('UNIT["Yard",0.9144]'), 0.9144, 0.9144, 'units "Yard"'),
    "local": (f'LOCAL_CS["site",{US}]', SURVEY_FOOT, SURVEY_FOOT, "US survey feet"),
    "meters": (plane('UNIT["metre",1]'), 1.0, 1.0, ""),
    "heights": (
        f'COMPD_CS["a",{plane("UNIT[metre,1]".replace(chr(34) * 2, chr(34)))},VERT_CS["h",VERT_DATUM["v",2005],{US}]]',
        1.0,
        SURVEY_FOOT,
        "x and y are in meters, heights in US survey feet, so the surface is distorted",
    ),
    "both feet": (
        f'COMPD_CS["a",{plane(US)},VERT_CS["h",VERT_DATUM["v",2005],UNIT["foot",0.3048]]]',
        SURVEY_FOOT,
        0.3048,
        "coordinates are in US survey feet",
    ),
    "second version": (second(FOOT_2, METER_2), 0.3048, 1.0, "x and y are in feet, heights in meters"),
    "second version, one unit": (second(FOOT_2, FOOT_2), 0.3048, 0.3048, "coordinates are in feet"),
    "three axes": (
        'PROJCRS["p",BASEGEOGCRS["b"],CS[Cartesian,3],'
        f'AXIS["E",east,{METER_2}],AXIS["N",north,{METER_2}],AXIS["h",up,{FOOT_2}]]',
        1.0,
        0.3048,
        "heights in feet",
    ),
    "geocentric": ('GEOCCS["g",DATUM["W",SPHEROID["W",6378137,298]],UNIT["metre",1]]', 1.0, 1.0, ""),
    "cut off": (plane(US).partition("048")[0], 1.0, 1.0, ""),
    "no length": (plane('UNIT["foot",0.3.4]'), 1.0, 1.0, ""),
    "no brackets": ("]]]] , PROJCS", 1.0, 1.0, ""),
}


def write(path, *records, places=PLACES):
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.full(3, 1e-3), np.floor(places.min(axis=0))
    header.vlrs.extend(records)
    las = laspy.LasData(header)
    las.xyz = places
    las.write(str(path))
    return path


def words(text):
    return laspy.vlrs.known.WktCoordinateSystemVlr(text)


def keys(*entries, sizes=(), names=b""):
    """Keys of GeoTIFF, each its number, where it is, count and value."""
    records = [laspy.VLR("LASF_Projection", 34735, "", struct.pack("<4H", 1, 1, 0, len(entries)))]
    records[0].record_data += b"".join(struct.pack("<4H", *entry) for entry in entries)
    records.append(laspy.VLR("LASF_Projection", 34736, "", np.array(sizes, "<f8").tobytes()))
    records.append(laspy.VLR("LASF_Projection", 34737, "", names))
    return [record for record in records if record.record_data]


@pytest.mark.parametrize("name", SYSTEMS)
def test_units_of_wkt_are_told_and_converted(tmp_path, name):
    text, horizontal, vertical, told = SYSTEMS[name]
    path = write(tmp_path / "a.las", words(text))
    table, metric = read_points(path), read_points(path, las=LasChoices(meters=True))
    assert_allclose(table.points, PLACES, rtol=0.0, atol=1e-9)
    assert_allclose(metric.points, PLACES * (horizontal, horizontal, vertical), rtol=1e-9)
    assert len(table.notices) == bool(told)
    assert all(told in notice for notice in table.notices)
    assert any("converted to meters" in notice for notice in metric.notices) == (bool(told) or name in UNTOLD)
    assert not table.degrees


UNTOLD = ("cut off", "no length", "no brackets")  # which is told where meters are asked for
GEOTIFF = {
    "survey feet": (keys((1024, 0, 1, 1), (3076, 0, 1, 9003)), SURVEY_FOOT, "coordinates are in US survey feet"),
    "both": (keys((3076, 0, 1, 9002), (4099, 0, 1, 9002)), 0.3048, "coordinates are in feet"),
    "meters": (keys((3076, 0, 1, 9001), (4099, 0, 1, 9001)), 1.0, ""),
    "size": (keys((3076, 0, 1, 32767), (3077, 34736, 1, 1), sizes=[7.0, 0.9144]), 0.9144, "units of their own"),
    "cited": (
        keys((3072, 0, 1, 2994), (3073, 34737, 19, 7), names=b"NAD 83|Oregon Lambert (ft)|NAD83|"),
        0.3048,
        "coordinates are in feet",
    ),
    "cited survey feet": (keys((1026, 34737, 9, 0), names=b"NY (ftUS)|"), SURVEY_FOOT, "US survey feet"),
    "code": (keys((1024, 0, 1, 1), (3072, 0, 1, 2271)), 1.0, ""),
    "heights alone": (
        keys((3072, 0, 1, 2271), (4099, 0, 1, 9003)),
        1.0,
        "heights are in US survey feet, and the unit of x",
    ),
    "out of reach": (keys((3077, 34736, 1, 5), (3073, 34737, 9, 40), sizes=[0.3], names=b"x|"), 1.0, ""),
}


@pytest.mark.parametrize("name", GEOTIFF)
def test_units_of_geotiff(tmp_path, name):
    records, size, told = GEOTIFF[name]
    path = write(tmp_path / "a.las", *records)
    notices = read_points(path).notices
    assert len(notices) == bool(told)
    assert all(told in notice for notice in notices)
    assert_allclose(read_points(path, las=LasChoices(meters=True)).points, PLACES * size, rtol=1e-9)


def test_pieces_bounds_and_extent_are_in_meters_as_well(tmp_path):
    path, las = write(tmp_path / "a.las", words(plane(US))), LasChoices(meters=True)
    low, high = extent(path, las)[1:3]
    assert_allclose([low, high], SURVEY_FOOT * np.array([PLACES.min(axis=0), PLACES.max(axis=0)]), rtol=1e-9)
    found = chunks(path, bounds=(low - 1.0, high - (0.0, 0.0, 1.0)), las=las)
    assert_allclose(np.concatenate([points for points, _ in found]), SURVEY_FOOT * PLACES[:2], rtol=1e-9)
    assert found.notices == read_points(path, las=las).notices
    assert len(list(chunks(path, bounds=(low - 1.0, high)))) == 0


def test_degrees_are_no_lengths(tmp_path):
    path = write(tmp_path / "a.las", words(BASE), places=PLACES * (1e-4, 1e-4, 1.0))
    table = read_points(path, las=LasChoices(meters=True))
    assert table.degrees
    assert ["are degrees" in notice for notice in table.notices] == [True]


def test_what_is_said_of_many_files_is_said_once():
    assert join_notices(["a: x.", "b: x.", "a: x.", "a: y."]) == ["a and 1 other file: x.", "a: y."]
    assert join_notices(["a: x.", "b: x.", "c: x."]) == ["a and 2 other files: x."]
    assert join_notices(["no name", "a: x.", "no name", "none"]) == ["no name", "a: x.", "none"]
