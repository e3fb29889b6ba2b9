"""The table of results: what the manual tells of each, and how few files one takes."""

import re

import pytest

from command import quantities
from tests.core.test_architecture import BLENDER_SIDE, ROOT, imported
from tools.quantities import QUANTITIES, quantity

PAGES = [path.read_text(encoding="utf-8") for path in sorted(ROOT.glob("docs/operators/*.md"))]
CONSTANTS = {value: name for name, value in vars(quantities).items() if str(value).startswith("lb_")}
WIDELY = {  # scalars that the house itself needs
    "lb_area": "summed up, and weights of other results",
    "lb_mean_curvature": "on show where nothing else is chosen",
    "lb_motion": "written for each frame by a handler, and read by nodes that displace points",
    "lb_deviation": "beside which the panel offers to swap both clouds",
}


def by_name(rows):
    return pytest.mark.parametrize("row", rows, ids=lambda row: row.attribute)


def told(tool):
    """What the manual tells of a tool, below the headings that name it, as one line."""
    parts = [part for page in PAGES for part in re.split(r"^(?=#+ .*`meshfree\.)", page, flags=re.MULTILINE)]
    return " ".join(word for part in parts if f"`meshfree.{tool}`" in part.partition("\n")[0] for word in part.split())


@by_name(QUANTITIES)
def test_the_manual_tells_of_each_result_in_the_words_of_its_tooltip(row):
    text = told(row.tool)
    assert f"`{row.attribute}{'001' * row.numbered}`" in text
    assert row.tooltip.lower() in text.lower()


def names(path, row):
    """Whether a file names a result, by its attribute or by the constant for that."""
    text, constant = path.read_text(encoding="utf-8"), f"quantities.{CONSTANTS.get(row.attribute)}"
    return bool(re.search(rf"{row.attribute}\b", text)) or any(name.endswith(constant) for name in imported(path))


@by_name([row for row in QUANTITIES if row.data_type == "FLOAT" and row.attribute not in WIDELY and not row.numbered])
def test_a_scalar_result_takes_four_files_at_most(row):
    """The table and its tool; in core what computes it, and the list of public names."""
    assert len([path.name for path in BLENDER_SIDE if names(path, row)]) <= 2


@pytest.mark.parametrize(
    ("name", "attribute"),
    [
        ("lb_curvature_1", "lb_curvature_1"),
        ("lb_curvature_10", ""),
        ("lb_eigenvector_012", "lb_eigenvector_"),
        ("lb_area_2", ""),
        ("lb_rest", ""),
        ("weight", ""),
    ],
)
def test_attributes_find_their_rows(name, attribute):
    assert quantity(name).attribute == attribute
