"""Texts in the language of Blender's interface."""

from bpy.app.translations import pgettext_rpt as rpt_

from ..core.phrases import Phrase


def translated(text, look_up=rpt_) -> str:
    """Say a text, or what is wrong by an error, in the language that Blender speaks.

    Parameters
    ----------
    text : Phrase or PointCloudError
    look_up : callable
        From a template to its translation: that of reports, or another one of `bpy.app.translations`.
    """
    values = {
        name: translated(value, look_up) if isinstance(value, Phrase) else value
        for name, value in text.values.items()  # an error has them, too
    }
    return look_up(text.template).format(**values) if values else look_up(text.template)
