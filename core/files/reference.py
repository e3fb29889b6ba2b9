"""The coordinate system that a LAS file states, by WKT or by keys of GeoTIFF: as much of it as its units need."""

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..types import Floats

_FOOT, _SURVEY_FOOT = 0.3048, 1200.0 / 3937.0  # in meters
_SAME = 1e-7  # difference of lengths in writing one unit, relative; the two feet differ by 2e-6
_DISTORTED = 1e-5  # difference of units of which nobody would notice that they are not the same

_CONVERTED = "; they are converted to meters. Its coordinate system does not hold for these, and is not kept."
_GEOGRAPHIC = {"GEOGCS", "GEOGCRS", "GEOGRAPHICCRS", "GEODCRS", "GEODETICCRS"}
_PLANE = {"PROJCS", "PROJCRS", "PROJECTEDCRS", "LOCAL_CS", "ENGCRS", "ENGINEERINGCRS", "GEOCCS"}
_HEIGHTS = {"VERT_CS", "VERTCS", "VERTCRS", "VERTICALCRS"}
_UNITS = ("UNIT", "LENGTHUNIT")
_WORD = re.compile(r'"((?:[^"]|"")*)"|([A-Za-z_]\w*)\s*[\[(]|([\])])|([^\s,"\[\]()]+)')

# Keys of GeoTIFF.
_MODEL, _CITATIONS = 1024, (3073, 1026)
_LINEAR, _LINEAR_SIZE, _VERTICAL = 3076, 3077, 4099
_GEOGRAPHIC_MODEL = 2
_CODES = {9001: 1.0, 9002: _FOOT, 9003: _SURVEY_FOOT, 9036: 1000.0}  # of EPSG, in meters
_CITED = {  # by what the name of a system says, as in "NAD83 / Oregon (ft)"
    r"ft[\s_]?us|us[\s_]?ft|us[\s_](survey[\s_])?f(ee|oo)t|f(ee|oo)t[\s_]us": _SURVEY_FOOT,
    r"ft|f(ee|oo)t|int[\s_]?ft": _FOOT,
    r"m|met(er|re)s?": 1.0,
}


class Unit(NamedTuple):
    """A unit of length."""

    meters: float  # its length
    name: str = ""  # in the file; empty without one

    def __str__(self) -> str:
        """Name it in the plural."""
        for meters, name in (
            (1.0, "meters"),
            (_FOOT, "feet"),
            (_SURVEY_FOOT, "US survey feet"),
            (1000.0, "kilometers"),
        ):
            if self.is_like(meters):
                return name
        return f'units "{self.name}"' if self.name else "units of their own"

    def is_like(self, meters: float, most: float = _SAME) -> bool:
        """Whether it is as long as another one, but for a relative difference."""
        return abs(self.meters - meters) <= most * meters


class Reference(NamedTuple):
    """What a file states of its coordinates."""

    geographic: bool = False  # whether x and y are longitude and latitude
    # Of x and y, and of z; None where the file does not tell
    horizontal: Unit | None = None
    vertical: Unit | None = None

    @property
    def meters(self) -> Floats:
        """Lengths of the units of x, y and z in meters, (3,); 1 of all where the file tells none of x and y.

        Heights of which it tells none are in that of x and y, as is usual.
        """
        if self.horizontal is None:
            return np.ones(3)
        plane = self.horizontal.meters
        return np.array([plane, plane, plane if self.vertical is None else self.vertical.meters])

    def notices(self, path: Path, converted: bool) -> Iterator[str]:
        """Report units other than meters and what follows, or how they were converted to meters where that is asked."""
        plane, heights = self.horizontal, self.vertical or self.horizontal
        if self.geographic:
            return
        if plane is None or heights is None:
            if heights is not None and not heights.is_like(1.0):
                yield (
                    f"{path.name}: heights are in {heights}, and the unit of x and y is not told: if it is another one,"
                    " the surface is distorted."
                )
            if converted:
                yield f"{path.name}: the unit of its coordinates is not told, so they are not converted to meters."
        elif not plane.is_like(heights.meters, _DISTORTED):
            yield f"{path.name}: x and y are in {plane}, heights in {heights}" + (
                _CONVERTED
                if converted
                else ", so the surface is distorted, and areas and curvatures are wrong. LasChoices.meters converts"
                " them."
            )
        elif not plane.is_like(1.0):
            yield f"{path.name}: coordinates are in {plane}" + (
                _CONVERTED
                if converted
                else f", and so are lengths and areas. LasChoices.meters converts them; in meters one is"
                f" {plane.meters:.9g}."
            )


def read_reference(header: Any) -> Reference:
    """Return what the header of a LAS file states of its coordinates."""
    found = _of_wkt("".join(record.string for record in header.vlrs.get("WktCoordinateSystemVlr")))
    return found or _of_keys(header.vlrs)


def _of_wkt(text: str) -> Reference | None:
    """Return what WKT of either version tells; None if it has no coordinate system that is known here."""
    nodes = _parse(text)
    plane = next((node for node in nodes if node.name in _PLANE), None)
    if plane is not None:
        heights = next((node for node in nodes if node.name in _HEIGHTS), None)
        return Reference(False, plane.unit(), plane.unit(2) if heights is None else heights.unit())
    return Reference(True) if any(node.name in _GEOGRAPHIC for node in nodes) else None


class _Node:
    """A word of WKT with what is in its brackets: texts and numbers as words, and further nodes."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.words: list[str] = []
        self.nodes: list[_Node] = []
        self.closed = False  # as those that are cut off with a text are not, maybe inside a number

    def unit(self, axis: int | None = None) -> Unit | None:
        """Return the unit of a coordinate system, or of the axis of a number, which only the second version has."""
        axes = [node for node in self.nodes if node.name == "AXIS"]
        holders = [self, *axes[:1]] if axis is None else axes[axis : axis + 1]
        for node in (inner for holder in holders for inner in holder.nodes if inner.name in _UNITS):
            if node.closed and len(node.words) > 1 and (meters := _length(node.words[1])):
                return Unit(meters, node.words[0])
        return None


def _parse(text: str) -> list[_Node]:
    """Return the nodes of a text in their order, each before those inside, as far as its brackets go."""
    nodes, path = list[_Node](), list[_Node]()
    for quoted, name, closing, word in _WORD.findall(text):
        if name:
            nodes.append(_Node(name.upper()))
            if path:
                path[-1].nodes.append(nodes[-1])
            path.append(nodes[-1])
        elif path and closing:
            path.pop().closed = True
        elif path:
            path[-1].words.append(quoted or word)
    return nodes


def _length(text: str) -> float:
    """Return a length above zero; zero for all else."""
    number = re.fullmatch(r"[0-9.]+(?:[eE][+-]?[0-9]+)?", text)
    value = float(text) if number and text.count(".") < 2 else 0.0
    return value if math.isfinite(value) else 0.0


def _of_keys(records: Any) -> Reference:
    """Return what keys of GeoTIFF tell."""
    keys = {key.id: key for record in records.get("GeoKeyDirectoryVlr") for key in record.geo_keys}
    codes = {name: key.value_offset for name, key in keys.items() if not key.tiff_tag_location}
    if codes.get(_MODEL) == _GEOGRAPHIC_MODEL:
        return Reference(True)
    plane, heights = (_CODES.get(codes.get(key, 0)) for key in (_LINEAR, _VERTICAL))
    if plane is None and _LINEAR_SIZE in keys:
        sizes = [size.value for record in records.get("GeoDoubleParamsVlr") for size in record.doubles]
        plane = next((size for size in sizes[keys[_LINEAR_SIZE].value_offset :][:1] if 0.0 < size < math.inf), None)
    if plane is None:
        texts = "\0".join(text for record in records.get("GeoAsciiParamsVlr") for text in record.strings)
        cited = [texts[keys[key].value_offset :][: keys[key].count] for key in _CITATIONS if key in keys]
        plane = next((meters for text in cited if (meters := _cited(text))), None)
    return Reference(False, *(None if meters is None else Unit(meters) for meters in (plane, heights)))


def _cited(text: str) -> float | None:
    """Return the unit that the name of a coordinate system has in brackets, or as its last words."""
    for words, meters in _CITED.items():
        if re.search(rf"\(\s*(?:{words})\s*\)|[\s_,;/-](?:{words})[\s|]*$", text, re.IGNORECASE):
            return meters
    return None
