"""The base classes of all operators: when they may run, and how they report."""

from functools import wraps

from numpy.linalg import LinAlgError

from ...core import PointCloudError
from ..objects.notices import forget, keep, level_of
from ..objects.reading import obstacle, sharing_objects
from ..objects.words import in_blender

_TEXTS = {  # errors that any computation may raise, and what to report
    PointCloudError: "{}",
    MemoryError: "The memory is used up. Close other programs, or lower the Point Budget",
    LinAlgError: "The equations have no solution ({}). Raise Bandwidth Factor, or delete points that lie on each other",
    OSError: "A file could not be read or written: {}",
}
TROUBLES = tuple(_TEXTS)


def error_text(error) -> str:
    """Return the text that reports one of the `TROUBLES`."""
    return next(text for kind, text in _TEXTS.items() if isinstance(error, kind)).format(in_blender(str(error)))


def reporting(method):
    """Let a method of an operator, such as `execute`, report the errors that it raises."""

    @wraps(method)
    def guarded(self, context, *more):
        try:
            return method(self, context, *more)
        except TROUBLES as error:
            self.report({"ERROR"}, error_text(error))
            return {"CANCELLED"}

    return guarded


class NoticeOperator:
    """An operator whose notices are kept on the object that they concern, where the panel shows them.

    A report in the status bar disappears with the next one.
    """

    def warn(self, text: str, *objects):
        """Report a notice about objects, a warning if it says what to do, and keep it on them."""
        self._keep(level_of(in_blender(text)), text, objects)

    def note(self, text: str, *objects):
        """Report figures about objects, and keep them on them."""
        self._keep("INFO", text, objects)

    def _keep(self, level, text, objects):
        self.report({"INFO" if level == "NOTICE" else level}, in_blender(text))
        for owner in _owners(objects):
            keep(owner, self.bl_label, text, level)

    def begin_notices(self, objects):
        """Remove the notices of an earlier run of this operator from objects."""
        for owner in _owners(objects):
            forget(owner, self.bl_label)


def _owners(objects):
    """Return objects with those that share their points."""
    return [owner for obj in objects for owner in (obj, *sharing_objects(obj))]


class ReadyOperator(NoticeOperator):
    """An operator on the active object; where that cannot be used, the button is gray and its tooltip says why."""

    bl_options = {"REGISTER", "UNDO"}
    works_in = ("OBJECT",)  # modes of the object

    @classmethod
    def subject(cls, context):
        """Return the object to work on, or None."""
        return context.object

    @classmethod
    def obstacle(cls, context) -> str:
        """Return what keeps the operator from running, and what to do; empty if nothing does."""
        obj = cls.subject(context)
        return obstacle(obj, cls.works_in) or cls.lack(context, obj)

    @classmethod
    def lack(cls, context, obj) -> str:
        """Return what is missing beside an object that can be read and written, and what to do; empty if nothing is."""
        return ""

    @classmethod
    def poll(cls, context):
        reason = cls.obstacle(context)
        if reason:
            cls.poll_message_set(reason)
        return not reason
