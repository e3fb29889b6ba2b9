"""What columns are by their names: files of surveys have words of their own for x y z, in any order."""

import re
import unicodedata
from typing import NamedTuple

_AXES = (  # pairs of words for x and y that go together, and words for z; the surest first
    ({"x"}, {"y"}),
    (
        {"easting", "eastings", "east", "e", "rechtswert", "rechts", "rw", "ostwert", "ost", "este", "est", "utme"},
        {"northing", "northings", "north", "n", "hochwert", "hoch", "hw", "nordwert", "nord", "norte", "utmn"},
    ),
    (
        {"longitude", "long", "lon", "lng", "longitud", "laengengrad", "laenge", "geolaenge"},
        {"latitude", "lat", "latitud", "breitengrad", "breite", "geobreite"},
    ),
    ({"0"}, {"1"}),  # of a vector: Points:0, Points:1, Points:2
    ({"1"}, {"2"}),
)
_DEGREES = 2  # which of the pairs holds angles
_PLAIN = ({"z"}, {"2"}, {"3"})
_HEIGHTS = (
    {"elevation", "elev", "ele", "el"},
    {"height", "hgt", "ht", "hoehe", "h", "gelaendehoehe", "zed"},
    {"altitude", "alt", "altitud", "altura", "hauteur", "altezza", "cota", "quota", "level", "rl", "up", "u"},
    {"depth", "tiefe"},
)
_ANY = set().union(*(words for pair in _AXES for words in pair), *_PLAIN, *_HEIGHTS)
_FILLERS = re.compile(  # words that say nothing of what is measured: where, in which system, in which unit
    r"(points?|pts?|pos|positions?|locations?|loc|vertex|vertices|vert|utm\d*s?|epsg|grid|map|local|world|global"
    r"|ecef|geo|gps|gnss|wgs\d*|msl|asl|tvd(ss)?|nn|nhn|navd\d*|gk|mga\d*|ellipsoidal|ellipsoid|ell|orthometric|ortho|cent(er|re)"
    r"|centroid|mean|m|mm|cm|km|ft|usft|feet|met(er|re)s?|deg|degrees?|dd|p)"
)
_JOINED = re.compile(r"(coord(inate)?s?|koord(inaten?)?|koordinaten?|points?|positions?)")  # without a space as well
_OTHERS = re.compile(  # of columns that are no places
    r"(.*(id|number|nummer|index|name|time|zeit|date|datum|stamp|code|class|colou?r|norm(al)?|intensity|ance|ivity)"
    r"|no|nos|nr|num|nbr|label|idx|key|station|sta|pkt|punkt|track|line|ring|channel|beam|row|col|column"
    r"|[bdfnuvw][xyz]|t|s|sec|secs|seconds?|hour|min|utc|sod|epoch|week|tow"
    r"|classification|desc|description|layer|remarks?|comments?|type|status|flags?|group|cluster|segment|object"
    r"|i|int|intensit(aet|e)|amplitude|returns?|scalar|value|rgba?|r|g|b|a|red|green|blue|alpha|normals"
    r"|curvature|error|confidence|quality|roughness|density|range|azimuth|angle|temperature|speed|sigma|std|rms|count|scan)"
)
_SPELLED = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue"})
_ABOUT_COLORS = ("color", "colour", "rgb", "rgba", "diffuse")
_TRIPLES = {
    "r,g,b": ("r", "g", "b"),
    "rf,gf,bf": ("r", "g", "b"),
    "red,green,blue": ("red", "green", "blue"),
    "nx,ny,nz": ("nx", "ny", "nz"),
    "normal x,normal y,normal z": ("nx", "ny", "nz"),
}


class Places(NamedTuple):
    """Which columns are x y z."""

    indices: list
    sure: bool  # whether their names say so
    plain: bool  # whether they are x y z by name
    degrees: bool  # whether x and y are angles


def _words(text):
    """Return the words of a name that say something, in lower case and without accents."""
    text = _JOINED.sub(" ", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text.translate(_SPELLED)).lower())
    text = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return [word for word in re.findall(r"[a-z0-9]+", text) if not _FILLERS.fullmatch(word)]


def _place(name):
    """Return the word of a name that tells its axis, such as x of POINT_X, empty if there is none.

    What stands in brackets is most often a unit, but may tell it better: Y (Rechtswert).
    """
    inside = " ".join(re.findall(r"[\[(<{]([^\])>}]*)", name))
    words = _words(re.sub(r"[\[(<{].*?([\])>}]|$)", " ", name))
    words += [word for word in _words(inside) if word in _ANY]
    if not words or not _ANY.issuperset(words):
        return ""
    return max(words, key=len)


def is_other(name) -> bool:
    """Tell whether a name is known as one of what is no place: a number, a time, a color and so on."""
    words = _words(re.sub(r"[\[(<{].*?([\])>}]|$)", " ", name))
    return not words or (not _place(name) and any(_OTHERS.fullmatch(word) for word in words))


def is_known(name) -> bool:
    """Tell whether a name is a word for what files of points hold."""
    return bool(_place(name)) or (bool(_words(name)) and is_other(name))


def find_places(names, numeric):
    """Find the columns of x y z by their names.

    Parameters
    ----------
    names : sequence of str or None
    numeric : sequence of int
        Indices of the columns that hold numbers.

    Returns
    -------
    Places or None
        None if there are no three that could be.
    """
    names = [name or "" for name in names]
    words = {index: _place(names[index]) for index in numeric if index < len(names)}
    heights = (*_PLAIN, *_HEIGHTS)
    for number, (easts, norths) in enumerate(_AXES):
        x, y = _first(words, easts), _first(words, norths)
        if x is None or y is None:
            continue
        fitting = heights if number < 3 else heights[number - 2 : number - 1]
        z = next((z for z in (_first(words, kind) for kind in fitting) if z not in (None, x, y)), None)
        if z is not None:
            plain = [words[index] for index in (x, y, z)] == ["x", "y", "z"]
            return Places([x, y, z], sure=True, plain=plain, degrees=number == _DEGREES)
        if number < 3:
            unknown = [
                index for index in words if index not in (x, y) and not words[index] and not is_other(names[index])
            ]
            return Places([x, y, unknown[0]], False, False, number == _DEGREES) if unknown else None
    unknown = [index for index in words if not is_other(names[index])]
    return Places(unknown[:3], False, False, False) if len(unknown) > 2 else None


def standard_names(names) -> dict:
    """Return new names for columns of colors and normals that are called otherwise, such as colorRed or NormalX."""
    found = {}
    for name in names:
        words = [word for word in _words(name) if word not in _ABOUT_COLORS]
        found.setdefault(" ".join(words), name)
    result = {}
    for triple, standard in _TRIPLES.items():
        if all(word in found for word in triple.split(",")):
            result |= {found[word]: name for word, name in zip(triple.split(","), standard, strict=True)}
    return result


def _first(words, kind):
    return next((index for index, word in words.items() if word in kind), None)
