"""Names of any language as single words of ASCII, such as headers of PLY files take."""

import re
import unicodedata
from itertools import chain, count

LETTERS = str.maketrans(  # where leaving out an accent does not do
    {"ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss", "æ": "ae", "Æ": "Ae", "œ": "oe"}
    | {
        "Œ": "Oe",
        "ø": "o",
        "\u0131": "i",
        "İ": "I",
        "Ø": "O",
        "ł": "l",
        "Ł": "L",
        "đ": "d",
        "Đ": "D",
        "ð": "d",
        "Ð": "D",
        "þ": "th",
        "Þ": "Th",
    }
)


def ascii_words(names: list[str]) -> list[str]:
    """Return names as words of ASCII, in their order, with numbers where they would be the same.

    Parameters
    ----------
    names : iterable of str
        Those that are such words stay as they are.
    """
    words = [_ascii_word(name) for name in names]
    taken = {name for name, word in zip(names, words, strict=True) if name == word}
    result = []
    for name, word in zip(names, words, strict=True):
        if name != word:
            numbered = (f"{word}_{number}" for number in count(2))
            word = next(free for free in chain([word], numbered) if free not in taken)
            taken.add(word)
        result.append(word)
    return result


def _ascii_word(name: str) -> str:
    """Return a name without accents, and _ in place of what is no letter, digit or sign of ASCII."""
    composed = unicodedata.normalize("NFKC", name).translate(LETTERS)
    letters = "".join(letter for letter in unicodedata.normalize("NFKD", composed) if not unicodedata.combining(letter))
    return re.sub("[^!-~]+", "_", letters) or "_"
