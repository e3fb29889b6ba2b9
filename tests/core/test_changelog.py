"""What a release says of itself, from the changelog."""

from pathlib import Path

import pytest

import changelog
from changelog import ChangelogError

ROOT = Path(__file__).parents[2]
HEAD = "# Changelog\n\n"
OLD = "## 0.10.0\n\n- Old.\n\n## 0.9.2\n\n- Older.\n"
TEXT = f"{HEAD}## Unreleased\n\nNew:\n\n- One\n  and a half.\n- Two.\n\n{OLD}"
NOTES = "New:\n\n- One\n  and a half.\n- Two."


def test_what_is_not_released_yet_becomes_the_version():
    text, notes = changelog.release(TEXT, "0.11.0")
    assert notes == NOTES
    assert text == TEXT.replace("Unreleased", "0.11.0")
    assert changelog.release(text, "0.11.0") == (text, notes)  # made again, as from a tag


@pytest.mark.parametrize(
    ("text", "version", "told"),
    [
        (TEXT, "0.10.0", "0.10.0 already"),
        (TEXT, "0.9.10", "0.9.10 does not come after 0.10.0"),
        (TEXT, "0.11", "0.11 is no version"),
        (TEXT, "v0.11.0", "v0.11.0 is no version"),
        (TEXT, "0.011.0", "0.011.0 is no version"),
        (TEXT, "", "Nothing is no version"),
        (HEAD + OLD, "0.11.0", "no section 0.11.0 or Unreleased"),
        (f"{HEAD}## Unreleased\n\n{OLD}", "0.11.0", "section of 0.11.0 in the changelog is empty"),
        (f"{HEAD}## 0.11.0\n\n{OLD}", "0.11.0", "section of 0.11.0 in the changelog is empty"),
    ],
)
def test_a_wrong_version_or_changelog_is_told(text, version, told):
    with pytest.raises(ChangelogError, match=told):
        changelog.release(text, version)


def test_items_and_paragraphs_come_in_one_line_each():
    wrapped = (
        "A word\nor two:\n\n- *One*,\n  wrapped.\n- Two.\n  - Within\n    two.\n\n```\na\n  b\n```\n\n# Three\n- Four."
    )
    assert changelog.unwrap(wrapped) == (
        "A word or two:\n\n- *One*, wrapped.\n- Two.\n  - Within two.\n\n```\na\n  b\n```\n\n# Three\n- Four."
    )


LINES = ["First:", "", *(f"- {'x' * (5 + 7 * i % 11)}" for i in range(6)), "", "Last:", "", "- y", "- z"]
ENDING = "The rest: there"


@pytest.mark.parametrize("longest", range(50, 160, 3))
def test_short_notes_are_the_first_items_that_fit(longest):
    notes = "\n".join(LINES)
    short = changelog.shorten(notes, ENDING, longest)
    as_pasted = len(short.replace("\n", "\r\n"))
    assert as_pasted <= longest
    if short == notes:
        return
    assert len(notes.replace("\n", "\r\n")) > longest
    kept = short.removesuffix(f"\n\n{ENDING}").split("\n")
    assert kept == LINES[: len(kept)]
    assert kept[-1].startswith("- ")
    left = [line for line in LINES[len(kept) :] if line.startswith("- ")]
    skipped = LINES[len(kept) : LINES.index(left[0], len(kept)) + 1]
    assert as_pasted + len("\r\n".join(["", *skipped])) > longest


def test_a_first_item_that_does_not_fit_is_told():
    with pytest.raises(ChangelogError, match="first item"):
        changelog.shorten(f"New:\n\n- {'x' * 100}\n- y", ENDING, 60)


def test_the_changelog_of_the_project_can_be_released():
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    found = changelog.sections(text)
    assert {"0.2.0", "0.1.0"} <= set(found)
    for notes in found.values():
        short = changelog.shorten(changelog.unwrap(notes), ENDING)
        assert 100 < len(short) <= changelog.LONGEST or short == notes
