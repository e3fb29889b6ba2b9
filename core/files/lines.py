"""Text in blocks of lines: all lines of a file at once would need many times its size."""

import codecs
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

from ..errors import InvalidPointsError

_BLOCK = 2**16  # characters that are read at once
_LONGEST = 100_000  # characters of a line, thousands of columns
_BRIEF = 100  # characters of a quotation in a message
_MARKED = re.compile(r"1\.?#(?:(INF)|QNAN|SNAN|IND|NAN)\d*|nan\(\w*\)", re.IGNORECASE)  # as Visual C writes them


def read_text(path: Path, skipped: tuple[str, ...] = ()) -> Iterator[list[str]]:
    """Yield lists of lines of a file of text; see `read_blocks`."""
    with open(path, encoding=_encoding(path), errors="replace") as file:
        yield from read_blocks(file, path, skipped)


def _encoding(path: Path) -> str:
    """Return the encoding of a text: UTF-16 by its byte order mark, UTF-8 if it is valid, or that of Windows."""
    with open(path, "rb") as file:
        start = file.read(_BLOCK)
    if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(start)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def read_blocks(file: TextIO, path: Path, skipped: tuple[str, ...] = ()) -> Iterator[list[str]]:
    """Yield lists of lines, without their ends, of an open file of text, with NaN and infinity as numpy reads them.

    Parameters
    ----------
    file : file object
        Of which each end of a line is read as \\n.
    path : pathlib.Path
        Its name, for the text of the error.
    skipped : tuple of str
        Prefixes of lines of any length; only the beginning of a longer one is yielded.

    Raises
    ------
    InvalidPointsError
        A line is too long to be a point.
    """
    while block := file.read(_BLOCK):
        end = file.readline(_LONGEST)
        lines = _unmarked(block + end).splitlines()
        if max(map(len, lines)) >= _LONGEST:
            if any(len(line) >= _LONGEST and not line.startswith(skipped) for line in lines):
                raise InvalidPointsError(
                    f"{path} has a line of {_LONGEST:,} characters or more, which is not a point. Export it again."
                )
            while len(end) == _LONGEST and end[-1] != "\n":
                end = file.readline(_LONGEST)
        yield lines


def _unmarked(text: str) -> str:
    """Return text with NaN and infinity as numpy reads them: in 1.#QNAN stands a # that begins no comment."""
    marked = "#" in text or "(" in text
    return _MARKED.sub(lambda match: "inf" if match[1] else "nan", text) if marked else text


def is_number(word: str) -> bool:
    """Whether a word is a number for numpy, which accepts fewer than Python: no 1_0, and no digits but 0 to 9."""
    try:
        float(word)
    except ValueError:
        return False
    return word.isascii() and "_" not in word


def brief(text: str) -> str:
    """Return the beginning of a text from a file."""
    return text if len(text) <= _BRIEF else f"{text[:_BRIEF]}..."
