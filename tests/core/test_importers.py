"""Kinds of file x columns x odd headers: each ends in the right values, or in a sentence that names the columns."""

import io
import itertools
import re
from dataclasses import dataclass, field

import laspy
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from core.files import read_points
from core.files.table import SCANNER

COUNT = 12
RANDOM = np.random.default_rng(4)
PLACES = np.round(RANDOM.uniform(0.0, 100.0, (COUNT, 3)), 3)
FAR = PLACES + [437_000.0, 5_412_000.0, 300.0]
BYTES = RANDOM.integers(0, 256, (COUNT, 3))
UNIT = RANDOM.normal(size=(COUNT, 3))
UNIT = np.round(UNIT / np.linalg.norm(UNIT, axis=1, keepdims=True), 6)
HEAT = np.round(RANDOM.normal(size=COUNT), 4)
TIMES = 1_400_000_000.0 + np.round(RANDOM.uniform(0.0, 1000.0, COUNT), 5)
IDS = 2**53 + 1 + 2 * np.arange(COUNT) ** 2  # odd, so that no double holds them
GAP = 3  # row of a missing cell, or of a point without a place
KEPT = np.arange(COUNT) != GAP


@dataclass
class Columns:
    """What a file holds, and what becomes of it.

    `told` are words of its notices where the columns have names, and `guessed` attributes where they have none.
    """

    names: list
    cells: list  # by column, texts
    places: np.ndarray = field(default_factory=lambda: PLACES)
    colors: np.ndarray | None = None
    attributes: dict = field(default_factory=dict)
    told: list = field(default_factory=list)
    guessed: dict | None = None


def texts(values, digits=3):
    return [f"{value:.{digits}f}" for value in values]


def whole(values):
    return [str(value) for value in values]


def xyz(points):
    return [texts(column) for column in points.T]


def holed(cells, row, word):
    return [*cells[:row], word, *cells[row + 1 :]]


PLAIN = xyz(PLACES)
COLUMNS = {
    "plain": Columns(["x", "y", "z"], PLAIN),
    "far": Columns(["x", "y", "z"], xyz(FAR), FAR),
    "colors 0 to 255": Columns(
        ["x", "y", "z", "red", "green", "blue"], PLAIN + [whole(column) for column in BYTES.T], colors=BYTES / 255.0
    ),
    "colors 0 to 1": Columns(
        ["x", "y", "z", "r", "g", "b"], PLAIN + [texts(column / 255.0, 6) for column in BYTES.T], colors=BYTES / 255.0
    ),
    "colors and alpha": Columns(
        ["x", "y", "z", "red", "green", "blue", "alpha"],
        PLAIN + [whole(column) for column in BYTES.T] + [COUNT * ["255"]],
        colors=BYTES / 255.0,
    ),
    "normals": Columns(
        ["x", "y", "z", "nx", "ny", "nz"], PLAIN + [texts(column, 6) for column in UNIT.T], attributes={"normal": UNIT}
    ),
    "colors and normals": Columns(
        ["x", "y", "z", "r", "g", "b", "nx", "ny", "nz"],
        PLAIN + [whole(column) for column in BYTES.T] + [texts(column, 6) for column in UNIT.T],
        colors=BYTES / 255.0,
        attributes={"normal": UNIT},
    ),
    "normals and colors": Columns(
        ["x", "y", "z", "nx", "ny", "nz", "r", "g", "b"],
        PLAIN + [texts(column, 6) for column in UNIT.T] + [whole(column) for column in BYTES.T],
        colors=BYTES / 255.0,
        attributes={"normal": UNIT},
    ),
    "intensity": Columns(
        ["x", "y", "z", "intensity"],
        [*PLAIN, texts(HEAT, 4)],
        attributes={"intensity": HEAT},
        guessed={"column_4": HEAT},
    ),
    "intensity and colors": Columns(
        ["x", "y", "z", "intensity", "r", "g", "b"],
        [*PLAIN, texts(HEAT, 4), *(whole(column) for column in BYTES.T)],
        colors=BYTES / 255.0,
        attributes={"intensity": HEAT},
    ),
    "ids": Columns(["x", "y", "z", "id"], [*PLAIN, whole(IDS)], attributes={"id": IDS}, guessed={"column_4": IDS}),
    "counted": Columns(
        ["id", "x", "y", "z"],
        [whole(range(7, 7 + COUNT)), *PLAIN],
        attributes={"id": np.arange(7, 7 + COUNT)},
        guessed={"column_1": np.arange(7, 7 + COUNT)},
    ),
    "times": Columns(
        ["x", "y", "z", "time"], [*PLAIN, texts(TIMES, 5)], attributes={"time": TIMES}, guessed={"column_4": TIMES}
    ),
    "no place of one point": Columns(
        ["x", "y", "z", "heat"],
        [holed(PLAIN[0], GAP, "nan"), *PLAIN[1:], texts(HEAT, 4)],
        PLACES[KEPT],
        attributes={"heat": HEAT[KEPT]},
        told=["left out 1 points"],
        guessed={"column_4": HEAT[KEPT]},
    ),
}
SURVEYS = {  # names, in the order easting, northing, height, and whether a notice names them
    "survey": (["Easting", "Northing", "Elevation"], True),
    "letters": (["E", "N", "H"], True),
    "German": (["Rechtswert", "Hochwert", "Höhe"], True),
    "brackets": (["Y (Rechtswert)", "X (Hochwert)", "H [m]"], True),
    "degrees": (["Longitude", "Latitude", "Altitude"], True),
    "short degrees": (["lon_deg", "lat_deg", "h_ell"], True),
    "units": (["X [m]", "Y [m]", "Z [m]"], False),
    "round units": (["X(m)", "Y(m)", "Z(m)"], False),
    "ArcGIS": (["POINT_X", "POINT_Y", "POINT_Z"], False),
    "coordinates": (["X_coord", "Y_coord", "Z_coord"], False),
    "joined": (["xcoordinate", "ycoordinate", "zcoordinate"], False),
    "ParaView": (["Points:0", "Points:1", "Points:2"], True),
    "mixed": (["X", "Y", "Elevation"], True),
    "upper": (["EASTING", "NORTHING", "HEIGHT"], True),
    "Spanish": (["Este", "Norte", "Cota"], True),
    "French": (["Coordonnée X", "Coordonnée Y", "Altitude"], True),
    "German letters": (["X-Wert", "Y-Wert", "Höhe"], True),
    "joined degrees": (["GPSLongitude", "GPSLatitude", "AltitudeMSL"], True),
    "Metashape": (["X/Easting", "Y/Northing", "Z/Altitude"], True),
    "systems": (["UTM_Easting", "UTM_Northing", "Ellipsoidal Height"], True),
}
STYLES = {
    "names": lambda names, rows, mark: [mark.join(names), *rows],
    "capitals": lambda names, rows, mark: [mark.join(names).upper(), *rows],
    "comment": lambda names, rows, mark: ["# " + mark.join(names), *rows],
    "slashes": lambda names, rows, mark: ["//" + mark.join(names), *rows],
    "percent": lambda names, rows, mark: ["% made by hand", "% " + mark.join(names), *rows],
    "comments behind": lambda names, rows, mark: ["# " + mark.join(names), "# Number of points: 12, mean: 2", *rows],
    "after a word": lambda names, rows, mark: ["# Columns: " + mark.join(names), *rows],
    "count": lambda names, rows, mark: ["//" + mark.join(names), str(COUNT), *rows],
    "quotes": lambda names, rows, mark: [mark.join(f'"{name}"' for name in names), *rows],
    "blank lines": lambda names, rows, mark: ["", mark.join(names), "", *rows[:5], "", "  ", *rows[5:], ""],
    "units": lambda names, rows, mark: [mark.join(names), mark.join(["[m]"] * len(names)), *rows],
    "trailing": lambda names, rows, mark: [line + mark for line in (mark.join(names), *rows)],
    "BOM": lambda names, rows, mark: ["\ufeff" + mark.join(names), *rows],
    "title": lambda names, rows, mark: ["Exported by somebody", mark.join(names), *rows],
}
DELIMITERS = {"commas": ",", "semicolons": ";", "tabs": "\t", "spaces": " ", "decimal commas": ";", "bars": "|"}


def lines_of(columns, delimiter):
    mark = DELIMITERS[delimiter]
    rows = [mark.join(row) for row in zip(*columns.cells, strict=True)]
    return mark, [row.replace(".", ",") for row in rows] if delimiter == "decimal commas" else rows


def write(path, lines, end="\n", encoding="utf-8"):
    path.write_bytes(end.join(lines).encode(encoding))
    return path


def check(table, columns, attributes=None):
    """Every number as the file has it; whole numbers to the last digit."""
    assert_allclose(table.points, columns.places, rtol=0.0, atol=1e-9)
    if columns.colors is None:
        assert table.colors is None
    else:
        assert_allclose(table.colors[:, :3], columns.colors, atol=1e-5)
        assert_array_equal(table.colors[:, 3], 1.0)
    attributes = columns.attributes if attributes is None else attributes
    assert table.attributes.keys() == attributes.keys()
    for name, values in attributes.items():
        found = table.attributes[name]
        assert [int(value) for value in found] == values.tolist() if values.dtype.kind == "i" else True
        assert_allclose(found, values, rtol=1e-15)


def told(table):
    return " ".join(table.notices)


@pytest.mark.parametrize("delimiter", DELIMITERS)
@pytest.mark.parametrize("name", COLUMNS)
def test_columns_with_names(tmp_path, name, delimiter):
    columns = COLUMNS[name]
    mark, rows = lines_of(columns, delimiter)
    for number, (style, make) in enumerate(STYLES.items()):
        suffix = ("xyz", "txt", "csv", "pts")[number % 4]
        end = ("\n", "\r\n")[number % 3 == 0]
        path = write(tmp_path / f"{number}.{suffix}", make(columns.names, rows, mark), end)
        table = read_points(path)
        wanted = {key.upper(): values for key, values in columns.attributes.items() if key != "normal"}
        wanted |= {key: values for key, values in columns.attributes.items() if key == "normal"}
        check(table, columns, wanted if style == "capitals" else None)
        assert len(table.notices) == len(columns.told), (style, table.notices)
        assert all(word in told(table) for word in columns.told)


@pytest.mark.parametrize("delimiter", DELIMITERS)
@pytest.mark.parametrize("name", COLUMNS)
def test_columns_without_names(tmp_path, name, delimiter):
    """Colors and normals are found by their numbers, others kept; what was taken for what is told."""
    columns = COLUMNS[name]
    _, rows = lines_of(columns, delimiter)
    for suffix, head in (("xyz", []), ("txt", ["# made by hand"]), ("csv", [str(COUNT)])):
        table = read_points(write(tmp_path / f"a.{suffix}", [*head, *rows]))
        check(table, columns, columns.guessed)
        if len(columns.names) > 3:
            assert all(f"column_{index + 1}" in told(table) for index in range(len(columns.names)))
        assert len(table.notices) == (len(columns.names) > 3) + len(columns.told)


@pytest.mark.parametrize("name", [name for name in COLUMNS if name not in ("ids", "counted", "times")])
def test_columns_of_pts_files(tmp_path, name):
    """Which have no names, and after the number of points the usual columns."""
    columns = COLUMNS[name]
    _, rows = lines_of(columns, "spaces")
    table = read_points(write(tmp_path / "a.pts", [str(COUNT), *rows]))
    attributes = columns.guessed
    if len(columns.names) == 4:
        attributes = {"intensity": next(iter(columns.guessed.values()))}
    if name not in ("normals", "colors and alpha"):  # six and seven columns are colors
        check(table, columns, attributes)
    assert_allclose(table.points, columns.places, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("delimiter", ["commas", "semicolons", "tabs", "spaces", "decimal commas"])
@pytest.mark.parametrize("survey", SURVEYS)
def test_names_of_surveys(tmp_path, survey, delimiter):
    """In any order, beside numbers of points and times, which never become places; a notice names the columns."""
    names, named = SURVEYS[survey]
    if delimiter == "spaces":
        names = [re.sub(r" (?=[A-Z])", "_", name) for name in names]
    columns = dict(zip(names, xyz(FAR), strict=True))
    for order in itertools.permutations(names):
        given = Columns(
            ["Point", *order, "GPS_Time", "Code"],
            [whole(range(101, 101 + COUNT)), *(columns[name] for name in order), texts(TIMES, 5), COUNT * ["GRD"]],
        )
        mark, rows = lines_of(given, delimiter)
        table = read_points(write(tmp_path / "a.csv", [mark.join(given.names), *rows]))
        assert_allclose(table.points, FAR, rtol=0.0, atol=1e-9)
        assert_array_equal(table.attributes["Point"], range(101, 101 + COUNT))
        assert_allclose(table.attributes["GPS_Time"], TIMES, rtol=1e-15)
        assert "left out Code, which holds text" in told(table)
        first = names[0].replace(" (", "(") if delimiter == "spaces" else names[0]
        assert (f"used {first}, " in told(table)) == named
        assert ("degrees" in told(table)) == ("degrees" in survey)


@pytest.mark.parametrize(
    ("head", "passed"),
    [
        (",0,1,2", True),  # as pandas numbers columns, with an empty name for that of rows
        ("17,4", True),
        ("Exported by somebody", False),
        ("# 17 4 3", False),
        ("Rows,Columns\n17,4", True),
    ],
)
def test_lines_of_numbers_before_the_points_are_told(tmp_path, head, passed):
    cells = [whole(range(COUNT)), *PLAIN]
    table = read_points(write(tmp_path / "a.csv", [head, *lines_of(Columns([], cells), "commas")[1]]))
    assert_allclose(table.points, PLACES, rtol=0.0, atol=1e-9)
    assert ("skipped" in told(table)) == passed


@pytest.mark.parametrize("row", [0, 150])
@pytest.mark.parametrize("delimiter", ["commas", "semicolons", "tabs"])
def test_a_column_of_few_numbers(tmp_path, delimiter, row):
    """Even if there is none for long."""
    mark = DELIMITERS[delimiter]
    rows = [mark.join(["1", "2", "3", "7" if index == row else "", ""]) for index in range(200)]
    table = read_points(write(tmp_path / "a.csv", [mark.join(["x", "y", "z", "heat", "none"]), *rows]))
    assert_array_equal(table.attributes["heat"], np.where(np.arange(200) == row, 7.0, np.nan))
    assert list(table.attributes) == ["heat"]
    assert "199 of heat" in told(table)
    assert "left out none, which has no numbers" in told(table)


@pytest.mark.parametrize("row", [0, GAP])
@pytest.mark.parametrize("column", [0, 1, 2])
def test_a_point_of_three_cells_of_which_one_is_empty(tmp_path, column, row):
    cells = list(PLAIN)
    cells[column] = holed(cells[column], row, "")
    table = read_points(write(tmp_path / "a.csv", ["x,y,z", *lines_of(Columns([], cells), "commas")[1]]))
    assert_allclose(table.points, PLACES[np.arange(COUNT) != row], rtol=0.0, atol=1e-9)
    assert f"1 of {'xyz'[column]}" in told(table)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16"])
def test_names_in_any_encoding(tmp_path, encoding):
    lines = ["Rechtswert;Hochwert;Höhe", *lines_of(Columns([], xyz(FAR)), "decimal commas")[1]]
    table = read_points(write(tmp_path / "a.csv", lines, "\r\n", encoding))
    assert_allclose(table.points, FAR, rtol=0.0, atol=1e-9)
    assert table.notices == ["a.csv: used Rechtswert, Hochwert, Höhe for x y z."]


@pytest.mark.parametrize("word", ["", "NA", "N/A", "#N/A", "null", "None", "-", '""'])
@pytest.mark.parametrize("delimiter", ["commas", "semicolons", "tabs", "decimal commas", "bars"])
def test_cells_without_a_number(tmp_path, delimiter, word):
    """A value becomes NaN, a point without a place is left out, and both are told."""
    names = ["x", "y", "z", "red", "green", "blue", "heat", "mass"]
    rest = [*(whole(column) for column in BYTES.T), texts(HEAT, 4), whole(range(COUNT))]
    for hole, row in ((6, 0), (6, GAP), (7, GAP), (7, COUNT - 1), (2, GAP)):
        cells = [*PLAIN, *rest]
        cells[hole] = holed(cells[hole], row, word)
        mark, rows = lines_of(Columns(names, cells), delimiter)
        table = read_points(write(tmp_path / "a.csv", [mark.join(names), *rows]))
        kept = np.arange(COUNT) != (row if hole == 2 else -1)
        assert_allclose(table.points, PLACES[kept], rtol=0.0, atol=1e-9)
        assert_allclose(table.colors[:, :3], BYTES[kept] / 255.0, atol=1e-6)
        heat, mass = HEAT.copy(), np.arange(COUNT, dtype=float)
        for index, values in ((6, heat), (7, mass)):
            values[row] = np.nan if hole == index else values[row]
        assert_array_equal(table.attributes["heat"], heat[kept])
        assert_array_equal(table.attributes["mass"], mass[kept])
        assert f"1 of {names[hole]}" in told(table)


@pytest.mark.parametrize("word", ["", "NA"])
def test_a_color_without_a_number_leaves_the_others_as_they_are(tmp_path, word):
    cells = [*PLAIN, *(whole(column) for column in BYTES.T)]
    cells[4] = holed(cells[4], GAP, word)
    rows = lines_of(Columns([], cells), "commas")[1]
    table = read_points(write(tmp_path / "a.csv", ["x,y,z,r,g,b", *rows]))
    assert_allclose(table.colors[KEPT, :3], BYTES[KEPT] / 255.0, atol=1e-6)
    assert "1 of g" in told(table)


@pytest.mark.parametrize(
    ("names", "taken"),
    [
        ("u,v,w,heat", "u, v, w"),
        ("id,u,v,w", "u, v, w"),
        ("time,heat,mass,gain", "heat, mass, gain"),
        ("time,heat,mass,size", None),
        ("Point,heat,mass,time", None),
        ("Y_Local7,X_Local7,Z_Local7,heat", "X_Local7, Y_Local7, Z_Local7"),
        ("x,y,heat,mass", "x, y, heat"),
        ("code,lon,lat,bathymetry", "lon, lat, bathymetry"),
        ("id,time,u,v", None),
        ("time,intensity,range,azimuth", None),
        ("id,r,g,b", None),
        ("lat,lon,time,speed", None),
        ("X,Y,X,heat", "X, Y, heat"),
        ("X,Y,X,time", None),
        ("nx,ny,nz,curvature", None),
        ("range,azimuth,elevation,intensity", None),
    ],
)
def test_names_that_are_no_places(tmp_path, names, taken):
    """They are told, or refused where none of them can be."""
    rows = [",".join(f"{value:.3f}" for value in row) for row in RANDOM.uniform(2.0, 5.0, (COUNT, 4))]
    path = write(tmp_path / "a.csv", [names, *rows])
    if taken:
        assert f"Used {taken}." in told(read_points(path))
    else:
        with pytest.raises(ValueError, match=f"has no x y z among its columns {names[:3].replace(',', ', ')}"):
            read_points(path)


@pytest.mark.parametrize("most", [1, 4])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("suffix", ["txt", "xyz"])
def test_lists_of_any_length_at_the_end_of_rows(tmp_path, suffix, end, most):
    """As COLMAP writes them, with the names some lines above."""
    head = ["# List of points:", "#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)"]
    head += [f"# Number of points: {COUNT}, mean track length: 2.5"]
    tracks = [" ".join(f"{i} {i + 3}" for i in range(1 + number % most)) for number in range(COUNT)]
    cells = [whole(7 * np.arange(COUNT)), *PLAIN, *(whole(column) for column in BYTES.T), texts(HEAT, 4), tracks]
    rows = lines_of(Columns([], cells), "spaces")[1]
    table = read_points(write(tmp_path / f"points3D.{suffix}", [*head, *rows], end))
    check(table, Columns([], [], colors=BYTES / 255.0), {"POINT3D_ID": 7 * np.arange(COUNT), "ERROR": HEAT})
    assert "columns or more at the end, which have no names" in told(table)


@pytest.mark.parametrize("delimiter", ["commas", "tabs", "spaces"])
@pytest.mark.parametrize("labels", ["numbers", "words"])
def test_names_of_rows_that_have_no_name_themselves(tmp_path, delimiter, labels):
    """As R and pandas write them."""
    cells = [whole(range(1, 1 + COUNT)) if labels == "numbers" else [f"row{i}" for i in range(COUNT)], *PLAIN]
    mark, rows = lines_of(Columns([], cells), delimiter)
    heads = [mark.join(["x", "y", "z"])] + ([mark.join(["", "x", "y", "z"])] if delimiter != "spaces" else [])
    for head in heads:
        table = read_points(write(tmp_path / "a.txt", [head, *rows]))
        assert_allclose(table.points, PLACES, rtol=0.0, atol=1e-9)
        assert list(table.attributes) == (["column_1"] if labels == "numbers" else [])


def ptx_scan(points, turn, place, more="", missed=0, columns=3):
    """Return lines of a scan whose points are moved by its matrix, and rays that hit nothing between them."""
    rows = [f"{x:.6f} {y:.6f} {z:.6f} 0.25{more}" for x, y, z in points]
    rows[1:1] = missed * ["0 0 0 0.500000" + (" 0 0 0" if more else "")]
    matrix = [" ".join(f"{value:g}" for value in row) for row in turn]
    place = " ".join(f"{value:.3f}" for value in place)
    moved = [f"{row} 0" for row in matrix] + [f"{place} 1"]
    return [str(columns), str(len(rows) // columns), place, *matrix, *moved, *rows]


@pytest.mark.parametrize("missed", [0, 3, 9])
@pytest.mark.parametrize("more", ["", " 255 51 0"])
@pytest.mark.parametrize("scans", [1, 3])
@pytest.mark.parametrize("name", ["a.ptx", "a.txt", "a.xyz", "a.pts", "a.csv"])
def test_ptx(tmp_path, name, scans, more, missed):
    turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # rows: where the axes point
    centers = np.array([437_000.0, 5_412_000.0, 300.0]) + 10.0 * np.arange(scans)[:, None]
    lines = [line for center in centers for line in ptx_scan(PLACES, turn, center, more, missed)]
    table = read_points(write(tmp_path / name, lines, "\r\n" if scans > 1 else "\n"))
    assert_allclose(table.points, np.concatenate([PLACES @ turn + center for center in centers]), atol=1e-6)
    assert_allclose(table.attributes[SCANNER], np.repeat(centers, COUNT, axis=0))
    assert_array_equal(table.attributes["intensity"], 0.25)
    assert (table.colors is not None) == bool(more)
    assert table.colors is None or np.allclose(table.colors[0], [1.0, 0.2, 0.0, 1.0])
    assert ("scan" in table.attributes) == (scans > 1)
    assert table.notices == ([f"{name}: left out {scans * missed} rays that hit nothing (0 0 0)."] if missed else [])


def test_ptx_of_scans_with_and_without_colors(tmp_path):
    lines = ptx_scan(PLACES, np.eye(3), (0, 0, 0), " 255 51 0") + ptx_scan(PLACES, np.eye(3), (1, 2, 3))
    colors = read_points(write(tmp_path / "a.ptx", lines)).colors
    assert_allclose(colors[[0, COUNT]], [[1.0, 0.2, 0.0, 1.0], [1.0, 1.0, 1.0, 1.0]])


def test_a_ptx_whose_points_were_moved_already(tmp_path):
    """Its matrix does nothing; the place of the scanner is the one that it names."""
    lines = ptx_scan(PLACES, np.eye(3), (50.0, 40.0, 60.0))
    lines[9] = "0 0 0 1"
    table = read_points(write(tmp_path / "a.ptx", lines))
    assert_allclose(table.points, PLACES)
    assert_array_equal(table.attributes[SCANNER], np.tile([50.0, 40.0, 60.0], (COUNT, 1)))


@pytest.mark.parametrize("suffix", ["xyz", "txt", "csv", "pts"])
@pytest.mark.parametrize("delimiter", DELIMITERS)
def test_columns_that_are_given(tmp_path, delimiter, suffix):
    cells = [*PLAIN, texts(HEAT, 4), texts(TIMES, 5)]
    mark, rows = lines_of(Columns([], cells), delimiter)
    path = write(tmp_path / f"a.{suffix}", [mark.join(["time", "x", "y", "z", "id"]), *rows])
    table = read_points(path, "z - x y heat")
    assert_allclose(table.points, np.column_stack([PLACES[:, 2], HEAT, PLACES[:, 0]]), rtol=0.0, atol=1e-9)
    assert_allclose(table.attributes["heat"], TIMES, rtol=1e-15)
    assert (list(table.attributes), table.notices) == (["heat"], [])
    table = read_points(path, "X,Y,Z,...")
    assert_allclose(table.points, PLACES, atol=1e-9)
    assert table.attributes == {}


@pytest.mark.parametrize(
    ("columns", "text"),
    [
        ("x y z", "3 columns are named, but its first point has 4"),
        ("x y z r g", "5 columns are named, but its first point has 4"),
        ("x y heat -", "do not name z"),
        ("a b c d", "do not name x y z"),
        ("x y z X", "name x more than once"),
        ("...", "do not name x y z"),
        ("x y z r ...", ""),
    ],
)
def test_columns_that_are_given_wrongly(tmp_path, columns, text):
    path = write(tmp_path / "a.xyz", 3 * ["1 2 3 4"])
    if text:
        with pytest.raises(ValueError, match=text):
            read_points(path, columns)
    else:
        assert len(read_points(path, columns).points) == 3
    with pytest.raises(ValueError, match="names its columns itself"):
        read_points(write(tmp_path / "a.ptx", ["1"]), columns)


def make_ply(order, columns):
    """Return a PLY file of columns by type and name."""
    names = "".join(f"property {kind} {name}\n" for (kind, name) in columns)
    form = "ascii" if order is None else f"binary_{'little' if order == '<' else 'big'}_endian"
    head = f"ply\nformat {form} 1.0\nelement vertex {COUNT}\n{names}end_header\n".encode()
    if order is None:
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        return head + "".join(" ".join(map(repr, row)) + "\n" for row in rows).encode()
    codes = {"uchar": "u1", "ushort": "u2", "int": "i4", "float": "f4", "double": "f8"}
    rows = np.empty(COUNT, [(name, order + codes[kind]) for kind, name in columns])
    for (_, name), column in columns.items():
        rows[name] = column
    return head + rows.tobytes()


def named(kind, names, values):
    return {(kind, name): column for name, column in zip(names, np.transpose(values), strict=True)}


XYZ = named("double", "xyz", PLACES)
RGB = ("red", "green", "blue")
VERTICES = {
    "plain": (XYZ, None, {}),
    "bytes": (XYZ | named("uchar", RGB, BYTES), BYTES / 255.0, {}),
    "single": (XYZ | named("float", RGB, (BYTES / 255.0).astype("f4")), BYTES / 255.0, {}),
    "normals": (XYZ | named("double", ("nx", "ny", "nz"), UNIT), None, {"normal": UNIT}),
    "numbers": (
        XYZ | {("int", "number"): 2**24 + 1 + np.arange(COUNT)},
        None,
        {"number": 2**24 + 1 + np.arange(COUNT)},
    ),
    "times": (XYZ | {("double", "time"): TIMES}, None, {"time": TIMES}),
}


@pytest.mark.parametrize("order", [None, "<", ">"])
@pytest.mark.parametrize("name", VERTICES)
def test_ply(tmp_path, name, order):
    columns, colors, attributes = VERTICES[name]
    (tmp_path / "a.ply").write_bytes(make_ply(order, columns))
    check(read_points(tmp_path / "a.ply"), Columns([], [], colors=colors), attributes)


PCD_TYPES = {"uchar": "U 1", "ushort": "U 2", "int": "I 4", "float": "F 4", "double": "F 8"}


def make_pcd(binary, columns):
    kinds = [PCD_TYPES[kind].split() for kind, _ in columns]
    lines = [
        "VERSION 0.7",
        "FIELDS " + " ".join(name for _, name in columns),
        "SIZE " + " ".join(size for _, size in kinds),
        "TYPE " + " ".join(kind for kind, _ in kinds),
        f"WIDTH {COUNT}",
        "HEIGHT 1",
        f"POINTS {COUNT}",
        f"DATA {'binary' if binary else 'ascii'}",
        "",
    ]
    body = make_ply("<" if binary else None, columns).split(b"end_header\n", 1)[1]
    return "\n".join(lines).encode() + body


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("name", VERTICES)
def test_pcd(tmp_path, name, binary):
    columns, colors, attributes = VERTICES[name]
    (tmp_path / "a.pcd").write_bytes(make_pcd(binary, columns))
    check(read_points(tmp_path / "a.pcd"), Columns([], [], colors=colors), attributes)


@pytest.mark.parametrize("bits", [0, 8, 16])
@pytest.mark.parametrize("extra", ["", "u1", "i4", "i8", "f8"])
@pytest.mark.parametrize("kind", ["las", "laz"])
def test_las(tmp_path, kind, extra, bits):
    header = laspy.LasHeader(point_format=7, version="1.4")
    header.scales, header.offsets = [0.001] * 3, [437_000.0, 5_412_000.0, 300.0]
    values = {"u1": BYTES[:, 0], "i4": IDS % 2**31, "i8": IDS, "f8": TIMES}.get(extra)
    if extra:
        header.add_extra_dim(laspy.ExtraBytesParams("number", extra))
    las = laspy.LasData(header)
    las.x, las.y, las.z = FAR.T
    las.intensity = np.arange(COUNT)
    if bits:
        las.red, las.green, las.blue = (BYTES * (257 if bits == 16 else 1)).T
    if extra:
        las.number = values
    file = io.BytesIO()
    las.write(file, do_compress=kind == "laz")
    (tmp_path / f"a.{kind}").write_bytes(file.getvalue())
    table = read_points(tmp_path / f"a.{kind}")
    assert_allclose(table.points, FAR, rtol=0.0, atol=1e-6)
    assert_array_equal(table.attributes["intensity"], range(COUNT))
    if extra:
        assert_array_equal(table.attributes["number"], values)
    assert (table.colors is not None) == bool(bits)
    assert not bits or np.allclose(table.colors[:, :3], BYTES / 255.0, atol=1e-6)


@pytest.mark.parametrize("hole", [None, np.nan, np.inf])
@pytest.mark.parametrize("code", ["<f4", ">f4", "<f8"])
@pytest.mark.parametrize("name", ["a.npy", "a.npz", "a.ply", "a.pcd"])
def test_binary_places_without_one(tmp_path, name, code, hole):
    points = PLACES.astype(code)
    if hole is not None:
        points[GAP, 1] = hole
    columns = named("float" if code == "<f4" else "double", "xyz", points)
    {
        "a.npy": lambda: np.save(tmp_path / name, points),
        "a.npz": lambda: np.savez(tmp_path / name, points=points),
        "a.ply": lambda: (tmp_path / name).write_bytes(make_ply(">" if code == ">f4" else "<", columns)),
        "a.pcd": lambda: (tmp_path / name).write_bytes(make_pcd(True, columns)),
    }[name]()
    table = read_points(tmp_path / name)
    kept = KEPT | (hole is None)
    assert_allclose(table.points, PLACES.astype(code)[kept])
    assert [notice for notice in table.notices if "left out" in notice] == (
        []
        if hole is None
        else [f"{name}: left out 1 points that the sensor missed ({'NaN' if hole != hole else 'NaN or infinity'})."]
    )


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("faces", ["", "vn 0 0 1\nf 1 2 3\n"])
@pytest.mark.parametrize("colors", ["", "bytes", "shares", "some"])
def test_obj(tmp_path, colors, faces, end):
    more = {
        "": COUNT * [""],
        "bytes": [" {} {} {}".format(*row) for row in BYTES],
        "shares": [" {:.6f} {:.6f} {:.6f}".format(*row) for row in BYTES / 255.0],
        "some": [" {:.6f} {:.6f} {:.6f}".format(*row) if index % 3 else "" for index, row in enumerate(BYTES / 255.0)],
    }[colors]
    rows = [f"v {x} {y} {z}{rest}" for (x, y, z), rest in zip(PLACES, more, strict=True)]
    table = read_points(write(tmp_path / "a.obj", ["# made by hand", "o Thing", *rows, faces], end))
    there = (np.arange(COUNT) % 3 > 0)[:, None] | (colors != "some")
    check(table, Columns([], [], colors=there * BYTES / 255.0 if colors else None), {})
    bare = -(-COUNT // 3)
    assert (f"{bare} of {COUNT} vertices have no color. They are black" in told(table)) == (colors == "some")
    assert ("faces" in told(table)) == bool(faces)


NORTHINGS = [f"{5_400_000 + 1.5 * i} {400_000 + 0.7 * i * i} {300 + 0.25 * (i % 3)}" for i in range(6)]


@pytest.mark.parametrize(
    ("names", "separator", "counted"),
    [
        ("; Y X Z", " ", False),
        ("* Y X Z", " ", False),
        ("REM Y X Z", " ", False),
        ("--id Y X Z", " ", True),
        (";y;x;z", ";", True),
        ("Punto,Norte,Este,Elevación", ",", True),
        ("Ponto,Norte,Leste,Elevação", ",", True),
        ("Nr,Noord,Oost,Hoogte", ",", True),
        ("Punt,RD-Y,RD-X,NAP", ",", True),
        ("Nord,Øst,Høyde", ",", False),
        ("Północ,Wschód,Wysokość", ",", False),
        ("No,Yukar\u0131,Sağa,Kot", ",", True),
        ("Pkt,Vorne,Y,X,Z", ",", None),
    ],
)
def test_northings_are_y_behind_any_mark_and_in_other_languages(tmp_path, names, separator, counted):
    before = {True: "{} ", False: "", None: "{} 7 "}[counted]
    rows = [(before.format(i + 1) + row).replace(" ", separator) for i, row in enumerate(NORTHINGS)]
    (tmp_path / "a.txt").write_text("\n".join([names, *rows]), encoding="utf-8")
    table = read_points(tmp_path / "a.txt")
    assert table.points[:2].tolist() == [[400_000.0, 5_400_000.0, 300.0], [400_000.7, 5_400_001.5, 300.25]]


@pytest.mark.parametrize(
    ("header", "told"),
    [("Northing,Easting", "Northing,Easting"), ("0,1,2", "its first row, 0 1 2, is read as a point")],
)
def test_headers_that_cannot_be_used_are_told(tmp_path, header, told):
    (tmp_path / "a.csv").write_text("\n".join([header, *(row.replace(" ", ",") for row in NORTHINGS)]))
    (notice,) = read_points(tmp_path / "a.csv").notices
    assert told in notice


def test_what_counts_the_points_is_no_guess_at_a_place(tmp_path):
    rows = [f"{i + 1} {row}" for i, row in enumerate(NORTHINGS)]
    (tmp_path / "a.txt").write_text("\n".join(["foo bar baz qux", *rows]))
    assert read_points(tmp_path / "a.txt").points[0].tolist() == [5_400_000.0, 400_000.0, 300.0]


def test_no_row_names_are_taken_for_granted_beside_an_id(tmp_path):
    rows = [f"{i + 1} {row} {7 * i}" for i, row in enumerate(NORTHINGS)]
    (tmp_path / "a.csv").write_text("\n".join(["id,y,x,z", *rows]).replace(" ", ","))
    assert read_points(tmp_path / "a.csv").points[0].tolist() == [400_000.0, 5_400_000.0, 300.0]


@pytest.mark.parametrize("separator", [" ", ",", ";", "\t"])
def test_nan_as_visual_c_writes_it_is_no_comment(tmp_path, separator):
    rows = [
        "x y z s t",
        "1 2 3 1.#QNAN 7",
        "4 5 6 -1.#IND00 8",
        "7 8 9 1.#INF 9",
        "1.#QNAN 8 9 -nan(ind) 9",
        "9 9 9 4 5",
    ]
    (tmp_path / "a.txt").write_text("\n".join(rows).replace(" ", separator))
    table = read_points(tmp_path / "a.txt")
    assert table.points.tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9], [9, 9, 9]]
    assert_array_equal(table.attributes["s"], [np.nan, np.nan, np.inf, 4.0])
    assert table.attributes["t"].tolist() == [7, 8, 9, 5]
    assert any("left out 1 points" in notice for notice in table.notices)


def test_fractions_in_bytes_of_a_ply_of_text_stay(tmp_path):
    head = "ply\nformat ascii 1.0\nelement vertex 2\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += "".join(f"property uchar {color}\n" for color in ("red", "green", "blue"))
    (tmp_path / "a.ply").write_text(head + "end_header\n1 2 3 0.5 0 0\n4 5 6 1 0.25 0\n")
    assert_allclose(read_points(tmp_path / "a.ply").colors[:, :3], [[0.5, 0.0, 0.0], [1.0, 0.25, 0.0]])


def test_colors_of_an_obj_with_alpha_are_no_weights(tmp_path):
    (tmp_path / "a.obj").write_text("v 1 2 3 0.5 0.25 1 0.75\nv 4 5 6 1 0 0 1\n")
    assert_allclose(read_points(tmp_path / "a.obj").colors, [[0.5, 0.25, 1.0, 0.75], [1.0, 0.0, 0.0, 1.0]])


TURNED = np.array([[0.0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 1, 0], [500_000, 5_400_000, 300, 1]])


@pytest.mark.parametrize(
    "matrix", [TURNED, TURNED.T, TURNED + 1e-9 * (np.arange(4) == 3)], ids=["rows", "columns", "rounded"]
)
@pytest.mark.parametrize("before", ["", "# exported by a scanner\n"])
@pytest.mark.parametrize("ending", ["txt", "ptx"])
def test_ptx_with_comments_or_a_matrix_of_columns_is_placed(tmp_path, matrix, before, ending):
    rows = "\n".join(" ".join(map(repr, row)) for row in matrix.tolist())
    head = f"2\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n{rows}\n"
    (tmp_path / f"a.{ending}").write_text(before + head + "1 2 3 0.25\n0 0 0 0.5\n")
    assert read_points(tmp_path / f"a.{ending}").points.tolist() == [[499_998.0, 5_400_001.0, 303.0]]


@pytest.mark.parametrize("largest", ["3.4028235e38", "-1.7976931348623157e308"])
def test_points_at_the_largest_number_have_no_place(tmp_path, largest):
    (tmp_path / "a.csv").write_text(f"x,y,z,s\n1,2,3,4\n{largest},{largest},{largest},5\n7,8,9,6\nnan,0,0,7\n")
    table = read_points(tmp_path / "a.csv")
    assert table.points.tolist() == [[1, 2, 3], [7, 8, 9]]
    assert table.attributes["s"].tolist() == [4, 6]
    assert "left out 2 points that the sensor missed (NaN, or beyond 1e+30)." in table.notices[-1]


def test_what_counts_points_is_no_intensity(tmp_path):
    rows = [f"{i} {x} {y} {z} {r} {g} {b}" for i, ((x, y, z), (r, g, b)) in enumerate(zip(PLACES, BYTES, strict=True))]
    (tmp_path / "a.txt").write_text("\n".join(rows))
    table = read_points(tmp_path / "a.txt")
    assert [*table.attributes] == ["column_1"]
    assert_allclose(table.colors[:, :3], BYTES / 255.0, atol=1e-6)


def test_a_full_alpha_beside_colors_as_shares_is_one(tmp_path):
    np.savetxt(tmp_path / "a.txt", np.hstack([PLACES, BYTES / 255.0, np.ones((COUNT, 1))]), fmt="%.8f")
    table = read_points(tmp_path / "a.txt")
    assert not table.attributes
    assert_allclose(table.colors[:, 3], 1.0)
