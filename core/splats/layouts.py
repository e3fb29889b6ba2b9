"""Layouts of vertices that are nearly those of trainers: whether they suffice for Gaussian splats, and completions."""

from collections.abc import Iterator, Sequence

import numpy as np

from ..files import unit_colors
from ..types import Array
from .columns import COLORS, NEEDED, OPACITY, PLACES, ROTATIONS, SCALES, encode_opacities, split, stack
from .harmonics import CONSTANT

_RGB = (("red", "green", "blue"), ("r", "g", "b"))
ANCHORS = "anchors of Scaffold-GS, Octree-GS or the like, from which a network makes splats and their colors"
_UNUSED = (
    (
        "its splats move and have a life time",
        ("motion_", "omega_", "trbf_"),
        "as those of SpacetimeGaussians, which is not used: all are shown at once, each at the middle of its time."
        " Export one moment by the program that trained them.",
    ),
    (
        "its splats are bound to triangles",
        ("binding", "face_id", "face_index", "triangle"),
        "as those of GaussianAvatars, with places, sizes and rotations relative to these, which the file does not hold:"
        " they are shown as they are stored. Export one pose by the program that trained them.",
    ),
)
_THIN = 1e-3  # of the shorter axis in the plane: how thick a splat without a third axis becomes


def hold_enough(names: Sequence[str]) -> bool:
    """Whether properties of these names suffice for splats: sizes, and opacities, colours or rotations.

    Colours and rotations must be complete if there are any. One size suffices for balls, two for flat splats. Anchors,
    from which a network makes splats, are none.
    """
    if are_anchors(names):
        return False
    there = set(names)
    sizes = [name in there for name in SCALES]
    halves = [group for group in (COLORS, ROTATIONS) if there.intersection(group) not in (set(), set(group))]
    marks = there.intersection((OPACITY, COLORS[0], ROTATIONS[0]))
    return there.issuperset(PLACES) and sizes[0] and sizes[2] <= sizes[1] and not halves and bool(marks)


def are_anchors(names: Sequence[str]) -> bool:
    """Whether properties of these names are those of anchors, as of Scaffold-GS: features, and offsets of splats."""
    return any(name.startswith(("f_anchor_feat", "f_offset")) for name in names)


def near_miss(names: Sequence[str]) -> str:
    """Return why a file that seems to hold splats holds points only, after its name; empty for other files."""
    if are_anchors(names):
        return f"holds {ANCHORS}: read as plain points. Splats are what 3D Gaussian Splatting trains."
    if hold_enough(names) or not {COLORS[0], SCALES[0], ROTATIONS[0]}.intersection(names):
        return ""
    missing = ", ".join(name for name in NEEDED if name not in names)
    return f"looks like Gaussian splats, but has no {missing}: read as plain points."


def remarks(names: Sequence[str]) -> Iterator[str]:
    """Yield which properties of splats are not used, by their names, as clauses after the name of the file."""
    for what, prefixes, text in _UNUSED:
        found = [name for name in names if name.startswith(prefixes)]
        if found:
            yield f"{what} ({', '.join(found[:3])}{', ...' if len(found) > 3 else ''}), {text}"


def completed(columns: dict[str, Array]) -> tuple[dict[str, Array], list[str]]:
    """Return the columns as trainers write them, for columns that `hold_enough`, and how missing ones were completed.

    The latter are clauses for a notice.
    """
    columns = dict(columns)
    return columns, [*filter(None, (add(columns) for add in (_add_colors, _add_opacity, _add_sizes, _add_rotations)))]


def _add_colors(columns: dict[str, Array]) -> str:
    if COLORS[0] in columns:
        return ""
    named = next((names for names in _RGB if columns.keys() >= set(names)), None)
    if named is None:
        columns.update(dict.fromkeys(COLORS, np.zeros(len(columns["x"]), np.float32)))
        return "no colors: splats are gray"
    colors = unit_colors(np.stack([columns[name] for name in named], axis=1))
    columns.update(split(COLORS, (colors[:, :3] - 0.5) / CONSTANT))
    for name in named:
        del columns[name]
    return f"colors by {' '.join(named)}: the same from all directions"


def _add_opacity(columns: dict[str, Array]) -> str:
    if OPACITY in columns:
        return ""
    columns[OPACITY] = np.full(len(columns["x"]), encode_opacities(1.0), np.float32)
    return "no opacity: splats are opaque"


def _add_sizes(columns: dict[str, Array]) -> str:
    if SCALES[2] in columns:
        return ""
    if SCALES[1] not in columns:
        columns.update(dict.fromkeys(SCALES[1:], columns[SCALES[0]]))
        return "scale_0 alone: splats are balls"
    columns[SCALES[2]] = stack(columns, SCALES[:2], np.float32).min(axis=1) + np.float32(np.log(_THIN))
    return "no scale_2 (2D splats): their third axis is a thousandth of the shorter one"


def _add_rotations(columns: dict[str, Array]) -> str:
    if ROTATIONS[0] in columns:
        return ""
    columns.update(split(ROTATIONS, np.tile([1.0, 0.0, 0.0, 0.0], (len(columns["x"]), 1))))
    return "no rotations: ellipsoids are aligned with the coordinate axes"
