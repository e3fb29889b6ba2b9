"""What a LAS file states beside the numbers of its points, kept so that they can be written as they were."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from ..types import Bools, Floats

SYSTEM = "LASF_Projection"  # who states the coordinate system
TIME, WKT = 0b1, 0b10000  # bits of the encoding: times do not begin anew each week; the system is in WKT
_KEPT = TIME | 0b1000 | WKT  # and that returns were made up; not those of waveforms
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
    """

    kind: int
    version: str
    scales: list[float]
    offsets: list[float]
    encoding: int = 0
    records: list[tuple[int, str, str]] = field(default_factory=list)
    extras: dict[str, dict[str, Any]] = field(default_factory=dict)
    full: float = FULL

    def scaled(self, factors: Floats) -> LasForm:
        """Return it for coordinates times some factors, (3,), of which its coordinate system tells nothing."""
        if (factors == 1.0).all():
            return self
        scales, offsets = (np.multiply(numbers, factors).tolist() for numbers in (self.scales, self.offsets))
        return replace(self, scales=scales, offsets=offsets, records=[])

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

    def system(self) -> Iterable[tuple[str, int, str, bytes]]:
        """Yield the records of the coordinate system as `laspy.VLR` takes them."""
        return ((SYSTEM, number, text, base64.b64decode(data)) for number, text, data in self.records)

    def to_json(self) -> dict[str, Any]:
        """Return it as numbers, texts, lists and dicts, of which `LasForm` makes it again."""
        return asdict(self)


def read_form(header: Any, extras: dict[str, Any]) -> LasForm:
    """Return what the header of laspy states, with the extra bytes of some columns by their names."""
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
            (record.record_id, str(record.description), base64.b64encode(record.record_data_bytes()).decode())
            for record in header.vlrs
            if record.user_id == SYSTEM
        ],
        {column: _parameters(item, missing.get(item.name)) for column, item in extras.items()},
    )


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

    Steps are the finest; extra bytes those that are the same in all.

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
    if len({form.encoding & TIME for form in found}) > 1:
        notices.append(
            "The GPS times of some files count from the begin of a week, those of others do not. They are kept as they"
            " are: do not compare them."
        )
    joined = replace(
        first,
        kind=max(form.kind for form in found),
        version=max(form.version for form in found),
        scales=np.min([form.scales for form in found], axis=0).tolist(),
        records=records,
        full=full,
        extras={
            name: item for name, item in first.extras.items() if all(form.extras.get(name) == item for form in found)
        },
    )
    return joined, notices
