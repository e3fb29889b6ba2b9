"""What all operators have in common: they run on objects that can be read and written, and can be undone."""

from .reading import obstacle


class ReadyOperator:
    """An operator for the active object; where that is unfit, the button is gray and its tooltip says why."""

    bl_options = {"REGISTER", "UNDO"}
    works_in = ("OBJECT",)  # modes of the object

    @classmethod
    def obstacle(cls, context) -> str:
        """Return what keeps the operator from running, and what to do; empty if nothing does."""
        return obstacle(context.object, cls.works_in)

    @classmethod
    def poll(cls, context):
        reason = cls.obstacle(context)
        if reason:
            cls.poll_message_set(reason)
        return not reason
