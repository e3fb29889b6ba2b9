"""What points take from the surface of others, for the command line and for Blender's tools."""

from __future__ import annotations

import math
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import core, quantities, tools
from .settings import Setting

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    from tools.tool import Array, Progress

Choice = tools.settings.Choice
FILLED, TAKEN, FAR = range(len(quantities.quantity(quantities.TRANSFER).names))
_NAMED = 5  # attributes that a notice names

MATCH = tools.settings.by_name(
    (
        Setting(
            "distance",
            "Points farther from the surface are filled in from around; 0 for 5 % of the size of the source, or two"
            " spacings of its points",
            0.0,
            0.0,
            form="LENGTH",
        ),
        Setting(
            "angle",
            "Points whose normals differ more from those of the surface are filled in from around",
            math.radians(30.0),
            math.radians(1.0),
            math.radians(90.0),
            form="DEGREES",
        ),
    )
)
ATTRIBUTES = tools.settings.by_name(
    (
        Setting(
            "attributes",
            "Which attributes of the source are transferred",
            "ALL",
            choices=(
                Choice("ALL", "All Attributes", "All attributes at points, but for results of this extension"),
                Choice("COLOR", "Active Color", "The colors that the source is shown in"),
                Choice("NAMES", "By Name", "Those whose names match the pattern, results of this extension among them"),
            ),
        ),
        Setting("pattern", "Names of attributes, for By Name: * stands for any text, ? for one character", "*"),
    )
)


class Match(NamedTuple):
    """Where points lie on the surface of sources."""

    laplacian: core.LaplaceBeltrami  # of the points
    places: core.rig.SurfaceMatch
    state: np.ndarray  # (n,) int, the number of a name of the result `quantities.TRANSFER`
    notices: list[str]  # about surfaces whose sheets are hardly told apart

    def share(self, state: int) -> float:
        """Return the share of the points in a state."""
        return np.count_nonzero(self.state == state) / len(self.state)

    @property
    def figures(self) -> dict[str, Any]:
        """What the command line prints of it."""
        return {"taken_count": int(self.places.known.sum()), "within": self.places.limit}


def matched(
    laplacian: core.LaplaceBeltrami,
    sources: list[core.LaplaceBeltrami],
    offsets: Sequence[Array],
    own: Any,
    name: str,
    names: Sequence[str],
    progress: Progress,
    members: Sequence[Array] | None = None,
) -> Match:
    """Find the places of points of some name on the surface of others.

    Offsets, (k, 3), lead from the points of the operator to those of each source; `own` has the values of the settings
    in `MATCH` as its attributes. For `members` see `match_surface`.
    """
    places = core.rig.match_surface(
        laplacian,
        sources,
        offsets=offsets,
        distance=own.distance or None,
        angle=min(own.angle, 0.5 * math.pi),
        members=members,
        progress=progress,
    )
    if not places.known.any():
        raise core.PointCloudError(
            f'No point of "{name}" lies within {places.limit:.3g} of the surface of {", ".join(names)}, with normals'
            " that agree. Move the objects onto each other, or raise Distance or Angle."
        )
    reached = np.isin(laplacian.component, laplacian.component[places.known])
    state = np.where(places.known, TAKEN, np.where(reached, FILLED, FAR))
    each = zip([*names, name], [*sources, laplacian], strict=True)
    return Match(laplacian, places, state, [text for named in each for text in _close_sheets(*named)])


def _close_sheets(name: str, laplacian: core.LaplaceBeltrami) -> list[str]:
    """Return a notice of the points of a cloud of some name between whose sheets values may get across."""
    causes = core.Doubt
    count = int(np.count_nonzero(laplacian.doubt == causes.SHEETS))
    return [
        f"Sheets of {name} are as close to each other as its points are, at {count:,} of them. Values may get from one"
        " sheet to the other there. Add points, or transfer each sheet alone."
    ][: min(count, 1)]


def told(
    match: Match, what: str, name: str, names: str, length_text: Callable[[float], str], preview: bool = False
) -> tuple[list[str], str]:
    """Return notices of how points of some name get what they take from others, and a line."""
    far = np.count_nonzero(match.state == FAR)
    take, are = ("would take", "would be") if preview else ("take", "are")
    line = (
        f"{name}: {match.share(TAKEN):.1%} of the points {take} {what} from {names},"
        f" within {length_text(match.places.limit)}, {match.share(FILLED):.1%} {are} filled in"
    )
    notice = (
        f"Points of parts of {name} of which none is near the source: {far:,}. They have the values of the nearest"
        " point that is. Raise Distance, or move the objects onto each other."
    )
    return [*([notice] if far else []), *match.notices], line


def is_wanted(name: str, own: Any, color: str) -> bool:
    """Whether an attribute is transferred by settings, which may ask for the colors alone."""
    if own.attributes == "COLOR":
        return name == color
    ours = name.startswith(quantities.PREFIX)
    if own.attributes == "ALL":
        return not ours
    return fnmatchcase(name, own.pattern) and (not ours or bool(quantities.quantity(name).attribute))


def check_found(found: Collection[str], own: Any, where: str) -> None:
    """Refuse a source of some name that has nothing that the settings ask for."""
    if not found:
        what = {
            "ALL": "attributes at its points, beside results of this extension",
            "COLOR": "colors",
            "NAMES": f'attributes at its points that match "{own.pattern}"',
        }[own.attributes]
        raise core.PointCloudError(f"{where} has no {what}. Choose other Attributes, or another source.")


def left_out(names: Sequence[str]) -> list[str]:
    """Return a notice of attributes that are not transferred."""
    if not names:
        return []
    return [
        "Attributes that are left out, since they are not at points, not finite, or not of one type in all"
        f" sources: {', '.join(names[:_NAMED])}{', ...' if len(names) > _NAMED else ''}."
    ]


def counted(names: Collection[str]) -> str:
    """Return how many attributes there are as a text."""
    return f"{len(names)} {'attribute' if len(names) == 1 else 'attributes'}"


def taken(match: Match, arrays: Mapping[str, Array], smooth: Sequence[str], progress: Progress) -> dict[str, Array]:
    """Return the values of the points by name: averages of the smooth ones, and others from the nearest point each."""
    result = {}
    if smooth:
        columns = [arrays[name].reshape(len(arrays[name]), -1) for name in smooth]
        found = core.rig.transfer_values(match.laplacian, match.places, np.column_stack(columns), progress=progress)
        ends = np.cumsum([column.shape[1] for column in columns])[:-1]
        for name, part in zip(smooth, np.split(found, ends, axis=1), strict=True):
            result[name] = part.reshape(len(part), *arrays[name].shape[1:])
    labels = [name for name in arrays if name not in smooth]
    if labels:
        rows = core.rig.transfer_labels(match.laplacian, match.places, np.arange(match.places.weights.shape[1]))
        result |= {name: arrays[name][rows] for name in labels}
    return {name: result[name] for name in arrays}
