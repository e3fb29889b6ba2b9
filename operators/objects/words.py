"""What Blender calls the settings and functions that texts of core name."""

_WORDS = {  # in texts of core, and in Blender
    "a greater bandwidth_factor": "a greater Bandwidth Factor",
    "LaplaceBeltrami.doubt tells": "Doubt, in the list of Show, tells",
    "by columns": "in Columns at the import",
    "Give columns only": "Give Columns only",
    "LasChoices.meters converts": "Convert to Meters converts",
    "; in meters one is": ". Set Unit Scale in the properties of the scene, which shows meters, to",
    "LasChoices.withheld keeps": "Withheld Points keeps",
    "write_splats writes": "Export Splats writes",
    "There are no points. Add points.": "There are no points. Add points, or choose another object.",
    "Install one that fits.": "Disable the extension that brings another one, or install this one again; then restart.",
}


def in_blender(text: str) -> str:
    """Return a text of core, an error or a notice, with the labels that a user of Blender sees."""
    for word, label in _WORDS.items():
        text = text.replace(word, label)
    return text
