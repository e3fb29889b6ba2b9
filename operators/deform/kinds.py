"""What bound objects follow: handles, or bones, each a kind that its module adds."""

from typing import Protocol

_kinds = {}


class Kind(Protocol):
    """How the points of an object follow something, for all that is the same of whatever they follow."""

    name: str  # kept by the binding
    followed: str  # what it follows, in texts
    at_once: bool  # whether a follower is made within a moment, so that it needs no thread

    def key(self, obj) -> tuple:
        """Return what the follower of an object depends on: its binding, which copies share, and settings."""

    def read_pose(self, obj, depsgraph=None):
        """Return the `Pose` of an object, evaluated by a depsgraph or else as in the viewport."""

    def plan_follower(self, obj):
        """Read a bound object; return a function of a progress callback that makes what moves its points.

        That has the methods of `Follower`.
        """

    def gone(self, obj) -> str:
        """Return why what an object follows is not there any more, and what to do; empty if it is."""

    def changed(self, obj, glance, trusting):
        """Return why a binding no longer holds, or an empty text, and which points may be moved; None if not known yet.

        For glances and trust see `stale_reason`.
        """

    def copied_from(self, obj):
        """Return the bound object from which another one was copied without what it follows; None for others."""

    def copy_reason(self, obj, original) -> str:
        """Return what is wrong with such a copy, and what to do."""

    def movers(self, obj) -> dict:
        """Return what moves the points, with the properties of a transform, by keys that undo does not change."""

    def written(self, obj) -> list:
        """Return the objects that operators on a bound object change, beside it."""

    def held(self, obj) -> str:
        """Return why the points cannot be taken over as they are shown, and what to do; empty if they can."""

    def kept(self, obj) -> str:
        """Return why what an object follows is not reset with it, and what to do; empty if it is."""

    def put_back(self, context, obj):
        """Reset what an object follows, and its points to rest, as far as that belongs to it."""

    def plan_rest(self, context, obj, operator):
        """Read a bound object; return a function of new positions, written already, that takes them as those at rest.

        It returns a line for the status bar. The operator reports notices, and has settings.
        """


def add(kind: Kind):
    """Add a kind."""
    _kinds[kind.name] = kind


def remove(kind: Kind):
    """Remove a kind."""
    del _kinds[kind.name]


def kind_of(obj) -> Kind:
    """Return the kind of the binding of an object."""
    return _kinds[obj.meshfree.deform.kind]
