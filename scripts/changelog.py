"""Read CHANGELOG.md, and write from it what a release says of itself."""

import re

PENDING = "Unreleased"
LONGEST = 1024  # characters of release notes that Blender's platform takes


class ChangelogError(Exception):
    """Why no release can be made from the changelog, in one sentence that says what to do."""


def sections(text):
    """Return the sections of a changelog, without their headings, by version."""
    _, *parts = re.split(r"^## +(.+?) *\n", text, flags=re.MULTILINE)
    return {name: body.strip() for name, body in zip(parts[::2], parts[1::2], strict=True)}


def release(text, version):
    """Turn the section of what is not released yet into that of a version, unless the version has one.

    Parameters
    ----------
    text : str
        The changelog.
    version : str
        Three numbers with dots between them.

    Returns
    -------
    text : str
        The changelog with a section of the version.
    notes : str
        That section.
    """
    found = sections(text)
    if version in found and PENDING in found:
        raise ChangelogError(
            f"The changelog has {version} already, and {PENDING} beside it: give the version another number"
        )
    if version not in found:
        if PENDING not in found:
            raise ChangelogError(f"The changelog has no section {version} or {PENDING}: write what users will notice")
        newest = max((name for name in found if name != PENDING), key=numbers, default="0.0.0")
        if numbers(version) <= numbers(newest):
            raise ChangelogError(f"{version} does not come after {newest}, the newest version of the changelog")
        text = re.sub(rf"^## +{PENDING} *$", f"## {version}", text, flags=re.MULTILINE)
        found[version] = found[PENDING]
    if not found[version]:
        raise ChangelogError(f"The section of {version} in the changelog is empty: write what users will notice")
    return text, found[version]


def numbers(version):
    """Return the three numbers of a version, which compare as versions do."""
    if not re.fullmatch(r"(0|[1-9]\d*)(\.(0|[1-9]\d*)){2}", version):
        raise ChangelogError(f"{version or 'Nothing'} is no version: it is three numbers, such as 1.2.3")
    return tuple(map(int, version.split(".")))


def unwrap(notes):
    """Write each item and paragraph in one line, since pages of releases keep the ends of lines; code stays."""
    parts = re.split(r"(^```.*?^```$)", notes, flags=re.MULTILINE | re.DOTALL)
    parts[::2] = [re.sub(r"(?<=\S)\n +(?! |[-*] )|(?<=\S)\n(?=[^\s\-#|])", " ", part) for part in parts[::2]]
    return "".join(parts)


def shorten(notes, ending, longest=LONGEST):
    """Keep as many items from the top as fit, followed by an ending if some are left out.

    The end of a line counts twice, as it does where notes are pasted into a form.

    Parameters
    ----------
    notes : str
        Items and paragraphs, each in one line.
    ending : str
        Says what is missing, and where the rest is.
    longest : int
        Characters.
    """
    lines = notes.split("\n")
    if _length(lines) <= longest:
        return notes
    while lines and _length([*lines, "", ending]) > longest:
        lines.pop()
    while lines and (not lines[-1].strip() or lines[-1].endswith(":") or lines[-1].startswith("#")):
        lines.pop()  # headings of groups whose items are left out
    if not lines:
        raise ChangelogError(f"Not even the first item fits into {longest} characters: begin with a shorter one")
    return "\n".join([*lines, "", ending])


def _length(lines):
    return sum(map(len, lines)) + 2 * (len(lines) - 1)
