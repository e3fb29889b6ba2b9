"""Kinds of columns by their names: files of surveys have words of their own for x y z, in any order."""

import re
import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from .ascii_words import LETTERS


class _System(NamedTuple):
    """Words for coordinates that go together."""

    x: set[str]
    y: set[str]
    z: tuple[set[str], ...]  # sets of words, the surest first


_HEIGHTS = (
    {"z"},
    {"elevation", "elev", "ele", "el"},
    {
        "height",
        "hgt",
        "ht",
        "hoehe",
        "h",
        "gelaendehoehe",
        "zed",
        "hae",
        "hoogte",
        "hoyde",
        "hojde",
        "hoejd",
        "wysokosc",
    },
    {"altitude", "alt", "altitud", "altura", "hauteur", "altezza", "cota", "quota", "level", "rl", "up", "u"}
    | {"elevacion", "elevacao", "elevazione", "kot", "nap", "vyska"},
    {"depth", "tiefe"},
)
_DEGREES = _System(
    {"longitude", "long", "lon", "lng", "longitud", "laengengrad", "laenge"},
    {"latitude", "lat", "latitud", "breitengrad", "breite"},
    _HEIGHTS,
)
_SYSTEMS = (  # the surest first
    _System({"x"}, {"y"}, _HEIGHTS),
    _System(
        {"easting", "eastings", "east", "e", "rechtswert", "rechts", "rw", "ostwert", "ost", "este", "est", "utme"}
        | {"leste", "oost", "wschod", "saga"},
        {"northing", "northings", "north", "n", "hochwert", "hoch", "hw", "nordwert", "nord", "norte", "utmn"}
        | {"noord", "polnoc", "yukari"},
        _HEIGHTS,
    ),
    _DEGREES,
    _System({"0"}, {"1"}, ({"2"},)),  # of a vector: Points:0, Points:1, Points:2
    _System({"1"}, {"2"}, ({"3"},)),
)
_ANY = set().union(*(words for system in _SYSTEMS for words in (system.x, system.y, *system.z)))
_FILLERS = re.compile(  # words that do not name a quantity but a position, system or unit
    r"(points?|pts?|p|pos|positions?|locations?|loc|vertex|vertices|vert|cent(er|re)|centroid|mean|wert"
    r"|grid|map|local|world|global|utm\d*s?|epsg|ecef|geo|gps|gnss|wgs\d*|gk|mga\d*|rd|eov"
    r"|msl|asl|tvd(ss)?|nn|nhn|ue|ueber|navd\d*|ellipsoidal|ellipsoid|ellps|ell|orthometric|ortho"
    r"|m|mm|cm|km|ft|usft|feet|met(er|re)s?|deg|degrees?|dd)"
)
_JOINED = re.compile(  # without a space as well
    r"(coord(inate|onnee|enada|inata)?s?|koord(inaten?)?|points?|positions?|(?<![a-z])pos|pos(?![a-z]))"
)
_OTHERS = re.compile(  # of columns that are not coordinates
    r"(.*(id|number|nummer|index|name|time|zeit|date|datum|stamp|code|class|colou?r|norm(al)?|intensity|ance|ivity)"
    r"|no|nos|nr|num|nbr|label|idx|key|station|sta|pkt|punkt|punto|ponto|track|line|ring|channel|beam|row|col|column"
    r"|[dfnuvw][xyz]|t|s|sec|secs|seconds?|hour|min|utc|sod|epoch|week|tow"
    r"|classification|desc|description|layer|remarks?|comments?|type|status|flags?|group|cluster|segment|object"
    r"|i|int|intensit(aet|e)|amplitude|returns?|scalar|rgba?|r|g|b|a|red|green|blue|alpha|normals"
    r"|curvature|error|confidence|quality|roughness|density|range|azimuth|angle|temperature|sigma|std|rms|count|scan"
    r"|speed|velocity|vel|gyro|rotation|rot|size|scale|width|length)"
)
_BRACKETS = re.compile(r"[\[(<{].*?([\])>}]|$)")
_ABOUT_COLORS = ("color", "colour", "rgb", "rgba", "diffuse")
_ALPHA = ("alpha", "a", "af")  # beside colors
_TRIPLES = {
    "r,g,b": ("r", "g", "b"),
    "rf,gf,bf": ("r", "g", "b"),
    "red,green,blue": ("red", "green", "blue"),
    "rot,gruen,blau": ("r", "g", "b"),
    "rouge,vert,bleu": ("r", "g", "b"),
    "rojo,verde,azul": ("r", "g", "b"),
    "rosso,verde,blu": ("r", "g", "b"),
    "vermelho,verde,azul": ("r", "g", "b"),
    "rood,groen,blauw": ("r", "g", "b"),
    "nx,ny,nz": ("nx", "ny", "nz"),
    "normal x,normal y,normal z": ("nx", "ny", "nz"),
}


class Places(NamedTuple):
    """Which columns are x y z."""

    indices: list[int]
    sure: bool  # whether by their names
    plain: bool  # whether they are x y z by name
    degrees: bool  # whether x and y are angles


def _words(text: str) -> list[str]:
    """Return the words of a name but fillers, in lower case and without accents."""
    text = unicodedata.normalize("NFKD", text.translate(LETTERS)).encode("ascii", "ignore").decode()
    text = _JOINED.sub(" ", re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", text).lower())
    return [word for word in re.findall(r"[a-z0-9]+", text) if not _FILLERS.fullmatch(word)]


def _place(name: str) -> str:
    """Return the word of a name for its axis, such as x of POINT_X, empty if there is none.

    Brackets mostly hold a unit, but may name it better: Y (Rechtswert).
    """
    words = _words(_BRACKETS.sub(" ", name))
    words += [word for word in _words(" ".join(re.findall(r"[\[(<{]([^\])>}]*)", name))) if word in _ANY]
    return max(words, key=len) if words and _ANY.issuperset(words) else ""


def _hint(name: str) -> str:
    """Return the only word of a name that may name its axis, beside unknown ones: Shape_X."""
    words = [word for word in _words(_BRACKETS.sub(" ", name)) if word in _ANY]
    return words[0] if len(words) == 1 and not is_other(name) else ""


def is_other(name: str) -> bool:
    """Whether a name is known as that of another column than coordinates: a number, a time, a color and so on."""
    words = _words(_BRACKETS.sub(" ", name))
    return not words or (not _place(name) and any(_OTHERS.fullmatch(word) for word in words))


def is_place(name: str) -> bool:
    """Whether a name is a word for a coordinate."""
    return bool(_place(name))


def is_known(name: str) -> bool:
    """Whether a name is a known word for a column of a file of points."""
    return bool(_place(name)) or (bool(_words(name)) and is_other(name))


def find_places(names: Sequence[str | None], numeric: list[int]) -> Places | None:
    """Find the columns of x y z by names, among those that hold numbers; None if there are no three that could be."""
    given = [name or "" for name in names]
    words = {index: _place(given[index]) for index in numeric if index < len(given)}
    found = _find_system(words)
    if found:
        return found
    hints = {index: word or _hint(given[index]) for index, word in words.items()}
    found = _find_system(hints)
    if found:
        return found._replace(sure=False)
    unknown = [index for index in words if not is_other(given[index])]
    system, *pair = next((found for found in _pairs(hints) if found[0].z is _HEIGHTS), [None])
    if pair:
        unknown = [*pair, *(index for index in unknown if not hints[index])]
    return Places(unknown[:3], False, False, system is _DEGREES) if len(unknown) > 2 else None


def _find_system(words: dict[int, str]) -> Places | None:
    """Find columns of x y z by the words for their axes, by index."""
    for system, x, y in _pairs(words):
        z = next((z for z in (_first(words, kind) for kind in system.z) if z is not None), None)
        if z is not None:
            plain = [words[index] for index in (x, y, z)] == ["x", "y", "z"]
            return Places([x, y, z], sure=True, plain=plain, degrees=system is _DEGREES)
    return None


def _pairs(words: dict[int, str]) -> Iterator[tuple[_System, int, int]]:
    """Yield systems of which there are x and y, with the indices of both."""
    for system in _SYSTEMS:
        x, y = _first(words, system.x), _first(words, system.y)
        if x is not None and y is not None:
            yield system, x, y


def standard_names(names: Iterable[str]) -> dict[str, str]:
    """Return new names for columns of colors and normals with other names, such as colorRed or NormalX."""
    found: dict[str, str] = {}
    for name in names:
        words = [word for word in _words(name) if word not in _ABOUT_COLORS]
        found.setdefault(" ".join(words), name)
    result: dict[str, str] = {}
    for triple, standard in _TRIPLES.items():
        if all(word in found for word in triple.split(",")):
            result |= {found[word]: name for word, name in zip(triple.split(","), standard, strict=True)}
            if standard[0] != "nx":
                result |= {found[word]: "alpha" for word in _ALPHA if word in found}
    return result


def _first(words: dict[int, str], kind: set[str]) -> int | None:
    """Return the first index of a word of a kind."""
    return next((index for index, word in words.items() if word in kind), None)
