"""Texts for people that can be translated: values are put in last, so that a dictionary can know the rest."""


class Phrase(str):
    """A text with values in it, in English, which remembers what it was made of.

    Parameters
    ----------
    template : str
        The text with a field for each value, as `str.format` takes it; without values, the text as it stands.
    values : object
        What goes into the fields; a value that is a `Phrase` itself can be translated in its turn, and all others are
        names, numbers and the like, in which braces mean nothing.

    Attributes
    ----------
    template : str
    values : dict
    """

    def __new__(cls, template, /, **values):
        """Put the values in."""
        text = super().__new__(cls, template.format(**values) if values else template)
        text.template, text.values = template, values
        return text

    def __getnewargs_ex__(self):  # to copy and pickle it: what it says is no template
        return (self.template,), self.values
