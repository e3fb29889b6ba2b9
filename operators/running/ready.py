"""What all operators have in common: they run on objects that can be read and written, and can be undone."""

from functools import wraps

from numpy.linalg import LinAlgError

from ...core import PointCloudError
from ..objects.notices import forget, keep
from ..objects.reading import obstacle, sharing_objects

_TEXTS = {  # what may go wrong in any computation, in plain words
    PointCloudError: "{}",
    MemoryError: "The memory is used up. Close other programs, or lower the Point Budget",
    LinAlgError: "The equations have no solution ({}). Raise Neighbors, or delete points that lie on each other",
    OSError: "A file could not be read or written: {}",
}
TROUBLES = tuple(_TEXTS)


def told(error) -> str:
    """What is told of one of the `TROUBLES`."""
    return next(text for kind, text in _TEXTS.items() if isinstance(error, kind)).format(error)


def reporting(method):
    """Let an operator report what a method of it, such as `execute`, refuses, and what may go wrong in any."""

    @wraps(method)
    def guarded(self, context, *more):
        try:
            return method(self, context, *more)
        except TROUBLES as error:
            self.report({"ERROR"}, told(error))
            return {"CANCELLED"}

    return guarded


class TellingOperator:
    """An operator whose warnings stay with the object that they are about, where the panel shows them.

    The line about a report in the status bar is gone with the next one.
    """

    def warn(self, text: str, *objects):
        """Report what somebody should know of some objects, and keep it there."""
        self._keep("WARNING", text, objects)

    def note(self, text: str, *objects):
        """Report figures of some objects that one looks at again, and keep them there."""
        self._keep("INFO", text, objects)

    def _keep(self, level, text, objects):
        self.report({level}, text)
        for owner in _owners(objects):
            keep(owner, self.bl_label, text, level)

    def begin_notices(self, objects):
        """Drop what this operator told of objects when it ran before."""
        for owner in _owners(objects):
            forget(owner, self.bl_label)


def _owners(objects):
    """Some objects, and those that show the same points."""
    return [owner for obj in objects for owner in (obj, *sharing_objects(obj))]


class ReadyOperator(TellingOperator):
    """An operator for the active object; where that is unfit, the button is gray and its tooltip says why."""

    bl_options = {"REGISTER", "UNDO"}
    works_in = ("OBJECT",)  # modes of the object

    @classmethod
    def subject(cls, context):
        """Return the object to work on, or None."""
        return context.object

    @classmethod
    def obstacle(cls, context) -> str:
        """Return what keeps the operator from running, and what to do; empty if nothing does."""
        return obstacle(cls.subject(context), cls.works_in)

    @classmethod
    def poll(cls, context):
        reason = cls.obstacle(context)
        if reason:
            cls.poll_message_set(reason)
        return not reason
