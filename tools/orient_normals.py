"""The side of the normals, for the results and all that is computed from them."""

from typing import Any

import numpy as np

from . import core
from .quantities import ORIENTATION, RESULTS
from .settings import Choice, Setting
from .tool import Array, Cloud, Laplacian, Length, Outcome, Progress, Row, Tool


class OrientNormals(Tool):
    """The tool. Of the operator it takes points, normals and areas."""

    name, label, verb = "orient_normals", "Orient Normals", "orient"
    help = "Choose the sign of the normals, for the results and all that is computed from them later"
    settings = (
        Setting(
            "method",
            "How the side is found",
            "WINDING",
            choices=(
                Choice("WINDING", "Winding Number", "By the generalized winding number, through gaps and in noise"),
                Choice(
                    "OUTSIDE",
                    "Outside",
                    "Consistent with neighbors, away from the center of each component, terrain up: the default of"
                    " Analyze Points",
                ),
                Choice("VIEWPOINT", "Viewpoint", "Towards an object, such as the camera"),
                Choice("ATTRIBUTE", "Attribute", "By a vector of each point, such as the scanner position"),
                Choice("KEEP", "As They Are", "Keep the present side, to flip it"),
            ),
        ),
        Setting("source", "Vector attribute, for Attribute", "", label="Attribute"),
        Setting(
            "holds",
            "Meaning of the vectors of the attribute",
            "POSITIONS",
            choices=(
                Choice("POSITIONS", "Positions", "Positions in local coordinates from which the points were seen"),
                Choice("DIRECTIONS", "Directions", "Directions to the outer side, such as normals from a file"),
            ),
            label="Attribute Holds",
        ),
        Setting("flip", "Reverse all normals afterwards", False),
    )
    panel, menu = Row("Clean", 2, 2), Row("Object", 3, 3)
    extended = shows = True

    def later(self, own: Any) -> tuple[str, ...]:
        return ("flip",)

    def writes(self, own: Any) -> tuple[str, ...]:
        return *RESULTS, ORIENTATION

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        """Return from where the points were seen, (3,) or (n, 3), or None, and notices of it."""
        if own.method == "VIEWPOINT":
            return cloud.viewpoint(), ()
        if own.method != "ATTRIBUTE":
            return None, ()
        if not own.source:
            raise core.PointCloudError(
                "No attribute is chosen to orient normals by. Choose one with a vector for each point."
            )
        return _seen_from(cloud, own)

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        viewpoint, told = inputs
        progress("Orientation", 0.9)
        if own.method == "KEEP":
            return laplacian.normals, told
        method = own.method.lower() if viewpoint is None else "viewpoint"
        given: dict[str, Any] = {"method": method, "viewpoint": viewpoint, "areas": laplacian.areas}
        return core.orient_normals(laplacian.points, laplacian.normals, **given), told

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        sides, told = found
        return Outcome({ORIENTATION: -sides if own.flip else sides}, "normals oriented", told)


def _seen_from(cloud: Cloud, own: Any) -> tuple[Array, tuple[str, ...]]:
    """Return from where points were seen by an attribute, (n, 3), and notices of those of which it does not say it.

    Points without a vector are seen from themselves, which says nothing of their side.
    """
    vectors = cloud.vectors("source", own.source, places=own.holds == "POSITIONS")
    there = np.asarray(np.isfinite(vectors).all(axis=1))
    count, missing = len(there), int(np.count_nonzero(~there))
    if missing == count:
        raise core.PointCloudError(
            f'The attribute "{own.source}" of {cloud.where} is NaN at all {count:,} points. Choose one that has'
            " vectors."
        )
    places = vectors if own.holds == "POSITIONS" else vectors + cloud.points
    told = f'{missing:,} of {count:,} points have no "{own.source}" (NaN). They take the side of the others around.'
    return np.where(there[:, None], places, cloud.points), (told,) if missing else ()


TOOL = OrientNormals()
