"""What points take from the surface of other objects: matching, and what all such tools have in common."""

from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from bpy.props import BoolProperty

from ...command import transferring
from ...command.naming import naming
from ...core import PointCloudError
from ...tools.quantities import TRANSFER
from ..objects.attributes import tag_changed, write_attribute
from ..objects.handlers import notify
from ..objects.properties import property_of
from ..objects.reading import TYPES, obstacle
from ..objects.result import length_text
from ..running.application import ShownOperator, Tool, chosen_objects, operator_reader

_BUILDING = 0.7  # share of the time that the operators of all objects take


class Source(NamedTuple):
    """An object that others take values from."""

    name: str
    operator: Any  # from a progress callback to its operator
    place: np.ndarray  # (3,), from its points as read to coordinates that all objects share
    values: Any  # what the tool has read of it


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
    distance: property_of(transferring.MATCH["distance"])
    angle: property_of(transferring.MATCH["angle"])
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
        own = SimpleNamespace(distance=self.distance, angle=self.angle)
        name, names = obj.name, [source.name for source in sources]

        def find(progress):
            def part(number):
                share = _BUILDING / (len(sources) + 1)
                return lambda stage, fraction: progress(stage, share * (number + fraction))

            laplacians = []
            for number, source in enumerate(sources):
                with naming(source.name):
                    laplacians.append(source.operator(part(number)))
            laplacian = operator(part(len(sources)))
            return transferring.matched(
                laplacian, laplacians, offsets, own, name, names, lambda stage, _: progress(stage, _BUILDING), members
            )

        return reading, find

    def write_state(self, obj, match, sources, what):
        """Write how points get what they take; return notices, and a line for the status bar."""
        write_attribute(obj.data, TRANSFER, match.state)
        tag_changed(obj.data)
        notices, line = transferring.told(match, what, obj.name, source_names(sources), length_text, self.preview)
        return [*notices, line]


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
    def lack(cls, context, obj):
        alone = f'Only "{obj.name}" is selected. Select the objects that take values, and last the source'
        return "" if sides(context, False)[1] else alone

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
