"""What a LAS file states beside the numbers of its points, kept so that they can be written as they were."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field, replace
from datetime import date
from typing import Any
from uuid import UUID

import numpy as np

from ..types import Bools, Floats
from .las_packages import import_las
from .las_packing import Record

SYSTEM = "LASF_Projection"  # who states the coordinate system
_OTHER_SYSTEM = "liblas"  # who states it once more
_FORMAT, _NAMES = "LASF_Spec", (0, 3)  # who states other things, and the numbers of names of classes, and of text
_PACKING = ("laszip encoded", "copc")  # who states how points are packed
_DESCRIBED = (4, *range(100, 355), 65535)  # numbers of extra bytes and waveforms
COMPATIBLE = "lascompatible"  # who states, and counts, points of LAS 1.4 that are written as of older versions
_OF_POINTS = ("LAStools", COMPATIBLE)  # who states what holds for the points of a file alone, such as an index
# Bits of the encoding: times do not begin anew each week; the system is in WKT; the header tells when times begin.
TIME, WKT, OFFSET = 0b1, 0b10000, 0b1000000
_KEPT = TIME | 0b1000 | WKT | OFFSET  # and that returns were made up; not those of waveforms
_BEGIN = "gps_time_offset"
_HEADER: dict[str, Callable[[Any], Any]] = {  # what else a header states, by laspy's names, of types that JSON has
    "file_source_id": int,
    "system_identifier": lambda text: text.encode("latin-1"),
    "creation_date": date.fromisoformat,
    "uuid": UUID,
    _BEGIN: int,
}
_WITHOUT_WAVEFORMS = {4: 1, 5: 3, 9: 6, 10: 8}  # point formats
FULL = 65535.0  # of a color
_NEAR = 0.25  # of a step, within which no other one may be meant
_ROUNDING = 8.0 * float(np.finfo(np.float64).eps)  # relative, of few operations


@dataclass(frozen=True)
class LasForm:
    """What a LAS file states beside the numbers of its points, in types that JSON has.

    Attributes
    ----------
    kind : int
        Point format, of those without waveforms.
    version : str
    scales, offsets : list of float
        Steps of x, y and z, and where they begin.
    encoding : int
        Bits of the header: the kind of times, and whether the coordinate system is in WKT.
    records : list
        Of the coordinate system: number, description, and contents in base64.
    extras : dict
        Of extra bytes by the names of columns: what `laspy.ExtraBytesParams` takes.
    full : float
        The number of a full color.
    header : dict
        What else the header states, by laspy's names.
    others : list
        Further records: whose, number, description, and contents in base64.
    """

    kind: int
    version: str
    scales: list[float]
    offsets: list[float]
    encoding: int = 0
    records: list[tuple[int, str, str]] = field(default_factory=list)
    extras: dict[str, dict[str, Any]] = field(default_factory=dict)
    full: float = FULL
    header: dict[str, Any] = field(default_factory=dict)
    others: list[tuple[str, int, str, str]] = field(default_factory=list)

    def scaled(self, factors: Floats) -> LasForm:
        """Return it for coordinates times some factors, (3,), of which its coordinate system tells nothing."""
        if (factors == 1.0).all():
            return self
        scales, offsets = (np.multiply(numbers, factors).tolist() for numbers in (self.scales, self.offsets))
        others = [record for record in self.others if record[0] != _OTHER_SYSTEM]
        return replace(self, scales=scales, offsets=offsets, records=[], others=others)

    def holds(self, points: Floats) -> Bools:
        """Return on which axes coordinates, (n, 3), are on the steps, and not too many of these, (3,)."""
        steps, places = self._steps(points)
        rounding = _ROUNDING * (np.abs(points) + np.abs(self.offsets))
        held = (np.abs(points - places) <= rounding) & (np.abs(steps) < 2.0**31 - 1.0)
        result: Bools = held.all(axis=0)
        return result

    def restored(self, points: Floats, error: float) -> Floats:
        """Return coordinates, (n, 3), those on the steps that have been kept with an error at most."""
        _, places = self._steps(points)
        near = np.abs(points - places) <= np.minimum(error, np.multiply(_NEAR, self.scales))
        return np.where(near, places, points)

    def _steps(self, points: Floats) -> tuple[Floats, Floats]:
        """Return the numbers of the steps that are next to coordinates, (n, 3), and the coordinates of these."""
        with np.errstate(all="ignore"):  # of scales that a file has wrong
            steps = np.rint((points - self.offsets) / self.scales)
            return steps, steps * self.scales + self.offsets

    def put(self, header: Any) -> None:
        """State what is neither steps nor extra bytes in the header of a file that is to be written, of laspy."""
        laspy, _ = import_las()
        header.global_encoding.value = self.encoding
        for user, number, text, data in [*((SYSTEM, *record) for record in self.records), *self.others]:
            header.vlrs.append(laspy.VLR(user, number, text.encode("latin-1"), base64.b64decode(data)))
        for name, value in self.header.items():
            setattr(header, name, _HEADER[name](value))

    def to_json(self) -> dict[str, Any]:
        """Return it as numbers, texts, lists and dicts, of which `LasForm` makes it again."""
        return asdict(self)


def read_form(header: Any, records: Iterable[Record], extras: dict[str, Any]) -> LasForm:
    """Return what the header of laspy and records state, with the extra bytes of some columns by their names."""
    number = header.point_format.id
    described = [item for record in header.vlrs.get("ExtraBytesVlr") for item in record.extra_bytes_structs]
    missing = {item.format_name(): item.no_data for item in described}  # which laspy tells nowhere else
    return LasForm(
        _WITHOUT_WAVEFORMS.get(number, number),
        str(header.version),
        header.scales.tolist(),
        header.offsets.tolist(),
        header.global_encoding.value & _KEPT,
        [
            (number, text, _base64(data))
            for user, number, text, data, _ in records
            if user == SYSTEM and data is not None
        ],
        {column: _parameters(item, missing.get(item.name)) for column, item in extras.items()},
        header=_stated(header),
        others=[
            (record.user, record.number, record.text, _base64(record.data))
            for record in records
            if record.data is not None and record.user != SYSTEM and not _is_anew(record) and not is_lost(record)
        ],
    )


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _stated(header: Any) -> dict[str, Any]:
    """Return what else a header of laspy states, in types that JSON has."""
    name = header.system_identifier  # bytes where it is not ASCII
    stated = {
        "file_source_id": header.file_source_id,
        "system_identifier": name if isinstance(name, str) else name.decode("latin-1"),
        "uuid": str(header.uuid),
        _BEGIN: header.gps_time_offset,
    }
    when = header.creation_date  # None where it is no date
    return stated if when is None else {**stated, "creation_date": when.isoformat()}


def is_lost(record: Record) -> bool:
    """Whether a record is neither kept nor written anew: it is long, or holds for the points of the file alone."""
    of_points = record.user in _OF_POINTS or (record.user == _FORMAT and record.number not in _NAMES)
    return not _is_anew(record) and (record.data is None or of_points or not record.user.isascii())


def _is_anew(record: Record) -> bool:
    """Whether a record tells how points are stored: a file that is written has its own."""
    return record.user in _PACKING or (record.user == _FORMAT and record.number in _DESCRIBED)


def _parameters(item: Any, missing: Any) -> dict[str, Any]:
    numbers = {"offsets": item.offsets, "scales": item.scales, "no_data": missing}
    return {
        "name": item.name,
        "type": item.type_str(),
        "description": str(item.description),
        **{name: np.asarray(values).tolist() for name, values in numbers.items() if values is not None},
    }


def join_forms(forms: Iterable[LasForm | None], full: float = FULL) -> tuple[LasForm | None, list[str]]:
    """Return one form for points of several files, and notices of what these differ in.

    Steps are the finest; extra bytes, further records and statements those that are the same in all.

    Parameters
    ----------
    forms : iterable of LasForm
        None for files of other kinds.
    full : float
        The number of a full color in all.
    """
    found = [form for form in forms if form is not None]
    if not found:
        return None, []
    stated = [form for form in found if form.records]
    first, notices = (stated or found)[0], list[str]()
    records = first.records
    if any([record[::2] for record in form.records] != [record[::2] for record in records] for form in stated):
        notices.append("The files state different coordinate systems. None is kept: transform them to one first.")
        records = []
    elif stated and len(stated) < len(found):
        notices.append(
            f"{len(found) - len(stated)} of the files state no coordinate system. That of the others is kept."
        )
    encoding = first.encoding
    if len({(form.encoding & (TIME | OFFSET), form.header.get(_BEGIN)) for form in found}) > 1:
        encoding &= ~OFFSET
        notices.append(
            "The GPS times of some files count from another begin than those of others, such as that of a week. They"
            " are kept as they are: do not compare them."
        )
    others = [record for record in first.others if all(record in form.others for form in found)]
    lost = {f"{record[0]} {record[1]}" for form in found for record in form.others if record not in others}
    if lost:
        notices.append(f"Left out records of headers that are not the same in all files: {', '.join(sorted(lost))}.")
    joined = replace(
        first,
        kind=max(form.kind for form in found),
        version=max(form.version for form in found),
        scales=np.min([form.scales for form in found], axis=0).tolist(),
        records=records,
        encoding=encoding,
        full=full,
        extras=_common([form.extras for form in found]),
        header=_common([form.header for form in found]),
        others=others,
    )
    return joined, notices


def _common(many: list[dict[str, Any]]) -> dict[str, Any]:
    """Return what is the same in all of some dicts."""
    return {name: item for name, item in many[0].items() if all(one.get(name) == item for one in many)}
