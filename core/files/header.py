"""The names of the columns of a text, from the lines before its rows."""

from .cells import is_comment
from .lines import is_number
from .names import find_places, is_known

_MARKS = "#/%! "


def find_names(rows, numeric) -> list:
    """Find the names of the columns in the lines before the first row.

    Parameters
    ----------
    rows : Rows
    numeric : list of int
        Indices of the columns that hold numbers.

    Returns
    -------
    list of str or None
        None for those without a name; fewer than there are columns if a list of any length follows; empty if no line
        names them.
    """
    usual = []
    for line in reversed(rows.before):
        for names in _split(line, rows.delimiter):
            names = _fit(names, is_comment(line), rows, numeric)
            found = find_places(names, numeric) if names else None
            if found and found.sure:
                return names
            usual = usual or names
    return usual


def _split(line, delimiter):
    """Yield the words of a line that may be names, by all that could separate them."""
    body = line.strip(" \r\n").lstrip(_MARKS) if is_comment(line) else line.strip(" \r\n")
    bodies = [body, body.partition(":")[2]] if is_comment(line) and ":" in body else [body]
    for text in bodies:
        for separator in dict.fromkeys((delimiter or ",", ",", ";", "\t", None)):
            parts = text.split(separator) if separator else _without_units(text).split()
            names = [name.strip().strip("\"'").strip() for name in parts]
            if len(names) > 2:
                yield names


def _without_units(text):
    """Return text without what stands in brackets: it may have spaces before and in it."""
    depth, result = 0, []
    for character in text:
        depth += character in "[("
        result.append("" if depth else character)
        depth = max(depth - (character in "])"), 0)
    return "".join(result)


def _fit(names, marked, rows, numeric):
    """Return names of columns if they can be those of the rows; otherwise none."""
    if any(map(is_number, names)):
        return []
    width, full = rows.width, len(names)
    lists = next((index for index, name in enumerate(names) if "[]" in name), None)  # of any length, at the end
    names = names[:lists]
    while len(names) > width and not names[-1]:
        names, full = names[:-1], full - 1
    known = [name for name in names if name and is_known(name)]
    if full == width and lists is None:
        return _distinct(names) if known or not marked else []
    if marked and lists is None and len(known) < len(names):
        return []
    if len(names) == width - 1 and (0 not in numeric or counts(rows)):  # R gives no name to those of rows
        names = [None, *names]
    if lists is None:
        names = [*names[:width], *[None] * (width - len(names))]
    found = find_places(names, numeric)
    return _distinct(names) if found and found.sure else []


def counts(rows):
    """Tell whether the first column counts the rows."""
    words = [row[0] for row in rows.sample]
    return (
        len(words) > 2
        and all(word.isdecimal() for word in words)
        and [int(word) for word in words] == [*range(int(words[0]), int(words[0]) + len(words))]
    )


def _distinct(names):
    """Number names that come again."""
    result = []
    for index, name in enumerate(names):
        name = f"column_{index + 1}" if name == "" else name
        again = sum(other == name for other in names[:index]) if name else 0
        result.append(f"{name}_{again + 1}" if again else name)
    return result
