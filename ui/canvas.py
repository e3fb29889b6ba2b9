"""Overlays of views: lists of shapes, which tests can read, drawn by Blender's gpu module."""

from typing import NamedTuple

import blf
import gpu
from gpu_extras.batch import batch_for_shader

FONT, FONT_SIZE = 0, 11  # Blender's own font, and its size in panels
PLATE_CORNERS = 6  # the first vertices of a picture
WHITE, DIM, PLATE = (1.0, 1.0, 1.0, 1.0), (1.0, 1.0, 1.0, 0.45), (0.08, 0.08, 0.08, 0.75)


class Text(NamedTuple):
    """A line of text, aligned at a position by its left end, center or right end, vertically centered."""

    text: str
    x: float
    y: float
    align: str  # "LEFT", "CENTER", "RIGHT"
    color: tuple
    part: str = ""  # its part of a legend in renders


def text_width(text) -> float:
    """Return the width of a text, in units of the user interface."""
    blf.size(FONT, FONT_SIZE)
    return blf.dimensions(FONT, text)[0]


class Picture:
    """Shapes on a background plate, in units of the user interface from its lower left corner."""

    movable = False  # by the mouse

    def __init__(self, width, height):
        self.width, self.height = width, height
        self.places, self.colors, self.texts = [], [], []  # three vertices and colours make a triangle
        self.rectangle(0.0, 0.0, width, height, PLATE)

    def rectangle(self, left, bottom, right, top, color, top_color=None):
        """Add a rectangle, of one colour or from one at its bottom to another at its top."""
        above = top_color or color
        self.places += [(left, bottom), (right, bottom), (right, top), (left, bottom), (right, top), (left, top)]
        self.colors += [color, color, above, color, above, above]

    def line(self, start, end, color, width=1.0):
        """Add a straight line."""
        (x0, y0), (x1, y1) = start, end
        length = max(((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5, 1e-6)
        dx, dy = 0.5 * width * (y0 - y1) / length, 0.5 * width * (x1 - x0) / length
        corners = [(x0 + dx, y0 + dy), (x0 - dx, y0 - dy), (x1 - dx, y1 - dy), (x1 + dx, y1 + dy)]
        self.places += [corners[index] for index in (0, 1, 2, 0, 2, 3)]
        self.colors += [color] * 6

    def dot(self, x, y, radius, color):
        """Add a small diamond."""
        left, right, bottom, top = (x - radius, y), (x + radius, y), (x, y - radius), (x, y + radius)
        self.places += [left, bottom, right, left, right, top]
        self.colors += [color] * 6

    def text(self, text, x, y, align="LEFT", color=WHITE, part=""):
        """Add a line of text."""
        self.texts.append(Text(text, x, y, align, color, part))


def draw(picture, x, y, scale):
    """Draw a picture with its lower left corner at a position of the view in pixels, scaled to pixels per unit."""
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    places = [(x + scale * px, y + scale * py, 0.0) for px, py in picture.places]
    batch = batch_for_shader(shader, "TRIS", {"pos": places, "color": picture.colors})
    gpu.state.blend_set("ALPHA")
    batch.draw(shader)
    gpu.state.blend_set("NONE")
    blf.size(FONT, FONT_SIZE * scale)
    middle = 0.5 * blf.dimensions(FONT, "0")[1]
    for text, px, py, align, color, _ in picture.texts:
        shift = {"LEFT": 0.0, "CENTER": 0.5, "RIGHT": 1.0}[align] * blf.dimensions(FONT, text)[0]
        blf.color(FONT, *color)
        blf.position(FONT, round(x + scale * px - shift), round(y + scale * py - middle), 0.0)
        blf.draw(FONT, text)
