"""The table of measures of all parts, kept with the object."""

from ...tools import measure_parts
from ..objects.parts import keep_rows
from .declared import registration_of


class KeptTable:
    """What Blender adds to the tool: the table is kept."""

    def write(self, context, obj, result):
        keep_rows(obj, result[0].rows, result[0].attribute)
        *notices, line = super().write(context, obj, result)
        return [*notices, f"{line}. The table is in the sidebar (N), Mesh-Free, Measure"]


TOOLS = (registration_of(measure_parts.TOOL, KeptTable),)
