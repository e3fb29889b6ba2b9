"""Colour maps as even samples."""

# sRGB in hexadecimal, low to high. Viridis and Magma are perceptually uniform: S. van der Walt, N. Smith, CC0.
_VIRIDIS = (
    "440154 481a6c 472f7d 414487 39568c 31688e 2a788e 23888e 1f988b 22a884 35b779 54c568 7ad151 a5db36 d2e21b fde725"
)
_MAGMA = (
    "000004 0b0924 20114b 3b0f70 57157e 721f81 8c2981 a8327d c43c75 de4968 f1605d fa7f5e fe9f6d febf84 fddea0 fcfdbf"
)
# Diverging with a light middle: K. Moreland, Diverging Color Maps for Scientific Visualization, 2009.
_COOL_WARM = (
    "3b4cc0 4e68d8 6282ea 779af7 8db0fe a3c2fe b9d0f9 ccd9ed dddcdc ecd3c5 f5c4ac f7b093 f4987a eb7d62 dd5f4b ca3b37"
    " b40426"
)
# A circle in OKLab, for uniform steps and equal ends: centre (0.6, 0.03, -0.04), radius 0.16, tilted by 40 degrees, so
# that lightness distinguishes its halves where hues do not.
_CYCLIC = (
    "40b2bb 2aaed4 25a6e8 349af5 488cfc 5b7bfc 6a6af5 775ae7 814cd5 8941bf 9039a7 96348e 9d3376 a3355f a83c49 ac4634"
    " ae541e ae6307 aa7409 a28526 969443 86a162 71ab81 5ab09f 40b2bb"
)
_MAPS = {"VIRIDIS": _VIRIDIS, "MAGMA": _MAGMA, "COOL_WARM": _COOL_WARM, "CYCLIC": _CYCLIC}
# For -1 as "none", then 0 to 6, distinct in any colour vision: M. Okabe, K. Ito, Color Universal Design, 2008.
_NONE, *_CLASSES = ("555555", "0072b2", "e69f00", "009e73", "d55e00", "56b4e9", "cc79a7", "f0e442")
# For classes 0 to 18 of LAS 1.4 as usual, brown ground, green plants, red buildings, blue water; more up to 30.
_LIDAR = (
    "7f7f7f c0c0c0 a0642d b5e655 4fc94f 1f7a1f e6332a ff00ff fff200 2a4bff 5c3a8c 404040 f5deb3 ffa07a ff7f00 8b0000"
    " ffc1e3 00b3b3 99004d 66ccff c98a4b e0ffff 9370db 004d4d 808000 00e6b8 ff6680 2b6f99 c8a200 c71585 1a3320"
)
_TRUTH = ("bdbdbd", "d55e00")
# The same for groups of points, by the names of `operators.groups`; none like Blender's orange of selected points.
_GROUPS = {
    "Handle": "b10026",
    "Anchor": "0072b2",
    "Fixed": "009e73",
    "Source": "f0e442",
    "Low": "332288",
    "High": "ffffff",
    "Value": "cc79a7",
    "Boundary": "56b4e9",
}


def colors(name: str, reverse: bool = False) -> list:
    """Return the colours of a map as linear (r, g, b, 1), low to high, as for shaders and colour ramps.

    Those of "TRUTH" are for 0 and 1, those of "CATEGORICAL" for -1, and for 0 to 6 and so on; of "LIDAR" to 30.
    """
    first = []
    if name == "TRUTH":
        codes = _TRUTH
    elif name == "CATEGORICAL":
        first, codes = [_NONE], _CLASSES
    elif name == "LIDAR":
        first, codes = [_NONE], _LIDAR.split()
    else:
        codes = _MAPS[name].split()
    return [_color(code) for code in (*first, *(reversed(codes) if reverse else codes))]


def group_color(role: str):
    """Return the colour of the groups of a role, as linear (r, g, b, 1)."""
    return _color(_GROUPS[role])


def to_display(color):
    """Convert linear (r, g, b, a) to sRGB."""
    return (*(12.92 * v if v <= 0.0031308 else 1.055 * v ** (1.0 / 2.4) - 0.055 for v in color[:3]), color[3])


def to_linear(color):
    """Convert sRGB to linear (r, g, b, 1)."""
    return (*(v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in color[:3]), 1.0)


def _color(code):
    return to_linear([int(code[i : i + 2], 16) / 255.0 for i in (0, 2, 4)])
