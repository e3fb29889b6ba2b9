"""The results of an analysis, by the table that the extension itself goes by."""

from tools.quantities import written_by

RESULTS = sorted([*written_by("analyze"), "lb_disc"])
