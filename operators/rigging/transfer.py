"""What points take from the surface of other objects: matching, and what all such tools have in common."""

import math
from typing import Any, NamedTuple

import numpy as np
from bpy.props import BoolProperty, FloatProperty

from ... import core
from ...command.quantities import TRANSFER, quantity
from ...core import PointCloudError
from ..objects.attributes import tag_changed, write_attribute
from ..objects.handlers import notify
from ..objects.reading import TYPES, obstacle
from ..objects.result import length_text
from ..running.application import ShownOperator, Tool, chosen_objects, naming, operator_reader

_BUILDING = 0.7  # share of the time that the operators of all objects take
_FILLED, _TAKEN, _FAR = range(len(quantity(TRANSFER).names))


class Source(NamedTuple):
    """An object that others take values from.

    Attributes
    ----------
    name : str
    operator : callable
        From a progress callback to its operator.
    place : ndarray, (3,)
        From its points as read to coordinates that all objects share.
    values : object
        What the tool has read of it.
    """

    name: str
    operator: Any
    place: np.ndarray
    values: Any


class Match(NamedTuple):
    """Where the points of an object lie on the surface of sources.

    Attributes
    ----------
    laplacian : LaplaceBeltrami
        Of the object.
    places : SurfaceMatch
    state : ndarray, (n,) int
        The number of a name of the result `TRANSFER`.
    notices : list of str
        About surfaces whose sheets are hardly told apart.
    """

    laplacian: Any
    places: Any
    state: np.ndarray
    notices: list

    def share(self, state) -> float:
        """Return the share of the points in a state."""
        return np.count_nonzero(self.state == state) / len(self.state)


class Transfer(Tool):
    """Settings and work of tools that take values from the surface of other objects.

    A subclass reads these of an object by `read_values`.
    """

    writes = (TRANSFER,)
    shows_colors = False  # whether the points are shown in their own colors where there is no attribute to show
    at_zero = {"distance": "Automatic"}

    reverse: BoolProperty(
        name="Reverse Transfer",
        description="From the other selected objects to the active one; otherwise from the active one to the others",
        default=False,
    )
    distance: FloatProperty(
        name="Distance",
        description="Points farther from the surface are filled in from around; 0 for 5 % of the size of the source, or"
        " two spacings of its points",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )
    angle: FloatProperty(
        name="Angle",
        description="Points whose normals differ more from those of the surface are filled in from around",
        default=math.radians(30.0),
        min=math.radians(1.0),
        max=math.radians(90.0),
        subtype="ANGLE",
    )
    preview: BoolProperty(
        name="Preview",
        description="Only color the points by what they would take, and change nothing else",
        default=False,
        options={"SKIP_SAVE"},
    )

    @property
    def shown(self):
        """Name of the attribute to show: what is taken, of a preview; else that of the result, empty for none."""
        return TRANSFER if self.preview else self.shown_result()

    def shown_result(self) -> str:
        """Return the name of the attribute to show after a transfer; empty if there is none."""
        return ""

    def read_values(self, obj):
        """Return what the points of an object can take from another one."""
        raise NotImplementedError

    def sources(self, context, obj):
        """Return what an object takes values from."""
        givers, _ = sides(context, self.reverse)
        for other in givers:
            reason = obstacle(other)
            if reason:
                raise PointCloudError(f"{reason}.")
            if other.data == obj.data:
                raise PointCloudError(
                    f'"{obj.name}" shares its mesh with "{other.name}", and has all of its values already. Deselect it.'
                )
        return [self.source(context, other, self.place(other)) for other in givers]

    def source(self, context, obj, place) -> Source:
        """Read an object that gives values."""
        with naming(obj.name):
            values = self.read_values(obj)
            return Source(obj.name, operator_reader(context, obj)[1], place, values)

    @staticmethod
    def place(obj):
        """Return the offset from the points of an object, as read, to coordinates that all objects share."""
        return np.array(obj.matrix_world.translation)

    def matcher(self, context, obj, sources, members=None):
        """Read an object, and return that, and a function of a progress callback that matches it with sources."""
        reading, operator = operator_reader(context, obj)
        offsets = np.array([source.place for source in sources]) - self.place(obj)
        settings = {"distance": self.distance or None, "angle": min(self.angle, 0.5 * math.pi), "members": members}
        name, names = obj.name, source_names(sources)

        def find(progress):
            def part(number):
                share = _BUILDING / (len(sources) + 1)
                return lambda stage, fraction: progress(stage, share * (number + fraction))

            laplacians = []
            for number, source in enumerate(sources):
                with naming(source.name):
                    laplacians.append(source.operator(part(number)))
            laplacian = operator(part(len(sources)))
            places = core.match_surface(
                laplacian, laplacians, offsets=offsets, **settings, progress=lambda stage, _: progress(stage, _BUILDING)
            )
            if not places.known.any():
                raise PointCloudError(
                    f'No point of "{name}" lies within {places.limit:.3g} of the surface of {names}, with normals that'
                    " agree. Move the objects onto each other, or raise Distance or Angle."
                )
            reached = np.isin(laplacian.component, laplacian.component[places.known])
            state = np.where(places.known, _TAKEN, np.where(reached, _FILLED, _FAR))
            each = zip([*(source.name for source in sources), name], [*laplacians, laplacian], strict=True)
            return Match(laplacian, places, state, [text for named in each for text in _close_sheets(*named)])

        return reading, find

    def write_state(self, obj, match, sources, what):
        """Write how points get what they take; return notices, and a line for the status bar."""
        write_attribute(obj.data, TRANSFER, match.state)
        tag_changed(obj.data)
        far = np.count_nonzero(match.state == _FAR)
        take, are = ("would take", "would be") if self.preview else ("take", "are")
        line = (
            f"{obj.name}: {match.share(_TAKEN):.1%} of the points {take} {what} from {source_names(sources)},"
            f" within {length_text(match.places.limit)}, {match.share(_FILLED):.1%} {are} filled in"
        )
        notices = [
            f"Points of parts of {obj.name} of which none is near the source: {far:,}. They have the values of the"
            " nearest point that is. Raise Distance, or move the objects onto each other."
        ]
        return [*(notices if far else ()), *match.notices, line]


def _close_sheets(name, laplacian) -> list:
    """Return a notice of the points of an object between whose sheets values may get across."""
    causes = core.Doubt
    count = np.count_nonzero(laplacian.doubt == causes.SHEETS)
    return [
        f"Sheets of {name} are as close to each other as its points are, at {count:,} of them. Values may get from one"
        " sheet to the other there. Add points, or transfer each sheet alone."
    ][: min(count, 1)]


def sides(context, reverse):
    """Return the objects that give values, and those that take them."""
    active = context.object
    others = [obj for obj in context.selected_objects if obj != active and obj.type in TYPES]
    return (others, [active]) if reverse else ([active], others)


def source_names(sources) -> str:
    """Return a text that names the sources."""
    return ", ".join(source.name for source in sources)


class TransferOperator(ShownOperator):
    """The base of operators that transfer: from the active object to the others, as Blender's Transfer Mesh Data."""

    keeps_line = True

    @classmethod
    def obstacle(cls, context):
        reason = super().obstacle(context)
        if reason or sides(context, False)[1]:
            return reason
        return f'Only "{context.object.name}" is selected. Select the objects that take values, and last the source'

    def conclude(self, context, objects):
        if self.shown:
            super().conclude(context, objects)
        elif self.show and self.shows_colors:
            notify("colors_found", objects)

    def chosen(self, context):
        _, takers = sides(context, self.reverse)
        objects, left_out = chosen_objects(context, self.becomes_single)
        objects = [obj for obj in objects if obj in takers]
        if not objects:
            reasons = " ".join(f"{reason}." for reason in left_out)
            raise PointCloudError(f"No selected object can take values beside the source. {reasons}".strip())
        return objects, left_out
