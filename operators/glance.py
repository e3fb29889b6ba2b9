"""Readings that take too long for each drawing of a panel: a glance may miss a change for some seconds."""

from time import perf_counter

_PATIENCE = 30.0  # a glance trusts what was read for this many times the seconds that reading took
_MOST = 100


class Glances:
    """What was read last, by what it is of."""

    def __init__(self):
        self._known = {}

    def read(self, key, read, glance: bool, trusting=False):
        """Return what a function without arguments reads; for a glance what it read lately, or ever if trusting."""
        known, until = self._known.get(key, (None, 0.0))
        began = perf_counter()
        if glance and key in self._known and (trusting or began <= until):
            return known
        known = read()
        if len(self._known) > _MOST:
            self._known.clear()
        now = perf_counter()
        self._known[key] = known, now + _PATIENCE * (now - began)
        return known

    def clear(self):
        """Read all again when it is needed."""
        self._known.clear()
