"""Figures 9 to 13, 15 and 16: what `make pictures` renders, in one place."""

from ..tables import Table
from .plots import DOCUMENTS

SHOWN = {
    "9": ("figure09.png", "Y_3^0 and Y_5^4 on 8,000 points: computed, displaced, analytic"),
    "10": ("figure10.png", "nodal domains on a plane and two parabolic cylinders with 441 points"),
    "11": ("figure11.png", "nodal domains of phi_6 on a trimmed star with 5,000 points, without and with 3 % noise"),
    "12": ("figure12.png", "low-pass filter of the armadillo: original, 1000, 100 and 10 modes"),
    "13a": ("figure13_planck.png", "outward deformation of Max Planck"),
    "13b": ("figure13_camel.png", "inward deformation of the camel's head"),
    "15": ("figure15.png", "uniform areas: a harmonic field and modes (the paper's Bimba is not at hand)"),
    "16": ("figure16.png", "phi_2 of a sausage of 3,000 points, without and with separation of sheets"),
}


def pictures():
    """Show the pictures that are there."""
    rows = [
        [number, text, f"![{text}](pictures/{name})"]
        for number, (name, text) in SHOWN.items()
        if (DOCUMENTS / "pictures" / name).exists()
    ]
    return Table(
        "Figures 9 to 16: pictures",
        ["figure", "what", "picture"],
        rows,
        "Rendered in Blender by `make pictures`; their numbers are among the targets of the applications.",
    )
