"""What all operators have in common: they run on objects that can be read and written, and can be undone."""

from .reading import obstacle


class ReadyOperator:
    """An operator for the active object; where that is unfit, the button is gray and its tooltip says why."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        reason = obstacle(context.object)
        if reason:
            cls.poll_message_set(reason)
        return not reason
