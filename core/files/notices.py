"""Notices of several files."""

from collections.abc import Iterable


def join_notices(notices: Iterable[str]) -> list[str]:
    """Return notices without repetition, those that say the same of several files as one.

    Parameters
    ----------
    notices : iterable of str
        Each begins with the name of its file and a colon; others stay as they are.

    Examples
    --------
    >>> import meshfree_laplacian as mf
    >>> notices = ["a.las: is in feet.", "b.las: is in feet.", "b.las: left out 3 points.", "c.las: is in feet."]
    >>> mf.files.join_notices(notices)
    ['a.las and 2 other files: is in feet.', 'b.las: left out 3 points.']
    """
    files: dict[str, list[str]] = {}
    for notice in dict.fromkeys(notices):
        name, colon, text = notice.partition(": ")
        files.setdefault(text if colon else notice, []).append(name)
    return [
        text if names == [text] else f"{names[0]}{_others(len(names) - 1)}: {text}" for text, names in files.items()
    ]


def _others(count: int) -> str:
    return f" and {count} other file{'s'[: count > 1]}" if count else ""
