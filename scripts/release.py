"""Check, test, build and describe a release: release.py VERSION.

The version goes into the manifest, which the wheel takes it from, and the part of the changelog that is not released
yet becomes that of the version. What is built from that tree comes into dist/VERSION, whole or not at all: a zip for
each platform, valid by Blender's own tool; the wheel; the release notes, whole and short; index.json, by which Blender
installs the extension from any server that has this folder, and index.html for people; the sums of all these files. If
anything fails, manifest and changelog are as they were.
"""

import argparse
import contextlib
import email
import json
import re
import shutil
import sys
import zipfile

import changelog
import licenses
import package
import pythons
from environments import ROOT, ensure, newest_blender, run

MANIFEST, CHANGELOG = ROOT / "blender_manifest.toml", ROOT / "CHANGELOG.md"
STAGE = ROOT / "build" / "release"
NOTES, SHORT_NOTES, SUMS = "release_notes.md", "release_notes_short.txt", "SHA256SUMS"
_SYSTEMS = {
    "linux-x64": "Linux",
    "windows-x64": "Windows",
    "macos-arm64": "macOS, Apple silicon",
    "macos-x64": "macOS, Intel processors (Blender 4.2 to 4.5)",
}


@contextlib.contextmanager
def kept(*paths):
    """Put files back as they were if anything goes wrong."""
    before = {path: path.read_bytes() for path in paths}
    try:
        yield
    except BaseException:
        for path, content in before.items():
            path.write_bytes(content)
        raise


def check_tree():
    """Stop where the tree holds what is in no commit, since nobody could build the same again."""
    if not (ROOT / ".git").exists():
        print("This is no checkout of git: nothing tells whether the tree is that of a commit", flush=True)
        return
    lines = run(["git", "status", "--porcelain"], capture_output=True, text=True).stdout.splitlines()
    left = [line[3:] for line in lines if line[3:] not in (MANIFEST.name, CHANGELOG.name)]
    if left:
        sys.exit(f"Commit or remove what is in no commit: {', '.join(left[:5])}{', ...' if left[5:] else ''}")


def set_version(version):
    """Write a version into manifest and changelog; return the section of the changelog."""
    text, notes = changelog.release(CHANGELOG.read_text(encoding="utf-8"), version)
    manifest, count = re.subn(
        r'^version = ".*"$', f'version = "{version}"', MANIFEST.read_text(encoding="utf-8"), flags=re.MULTILINE
    )
    if count != 1:
        sys.exit(f"{MANIFEST.name} has {count} lines with a version, and must have one")
    CHANGELOG.write_text(text, encoding="utf-8", newline="\n")
    MANIFEST.write_text(manifest, encoding="utf-8", newline="\n")
    return notes


def build_wheel(folder):
    """Build the wheel into a folder and return its path."""
    python = ensure("hatch", "hatch", next(iter(pythons.find().values())))
    run([python, "-m", "hatchling", "build", "-t", "wheel", "-d", folder], capture_output=True, text=True)
    (path,) = folder.glob("*.whl")
    return path


def check_licenses(zips, wheel):
    """Stop where the license of a zip, of what it brings, or of the wheel is missing or named nowhere."""
    named = package.read_manifest()["license"]
    wrong = [] if f"SPDX:{licenses.PROJECT}" in named else [f"{MANIFEST.name} does not name {licenses.PROJECT}"]
    text = (ROOT / "LICENSE").read_bytes()
    brought = set()
    for path in (*zips, wheel):
        with zipfile.ZipFile(path) as opened:
            brought |= {name.rpartition("/")[2] for name in opened.namelist() if name.endswith(".whl")}
            if not any(opened.read(name) == text for name in opened.namelist() if name.endswith("LICENSE")):
                wrong.append(f"{path.name} does not hold LICENSE")
    for name in sorted(brought):
        wrong += licenses.unnamed(package.WHEELS / name, named)
    with zipfile.ZipFile(wheel) as opened:
        (about,) = [name for name in opened.namelist() if name.endswith(".dist-info/METADATA")]
        if email.message_from_bytes(opened.read(about))["License-Expression"] != licenses.PROJECT:
            wrong.append(f"{wheel.name} does not name {licenses.PROJECT}")
    if wrong:
        sys.exit("\n".join(wrong))


def write_notes(folder, notes, page, untested=""):
    """Write the release notes, whole and short, into a folder.

    Parameters
    ----------
    folder : pathlib.Path
    notes : str
        Section of the changelog.
    page : str
        Address of the whole notes.
    untested : str
        Why the tests were not run; "" if they have passed.
    """
    changes = changelog.unwrap(notes)
    if untested:
        changes = f"The tests were not run by this build: {untested}.\n\n{changes}"
    platforms = package.read_manifest()["platforms"]
    zips = "\n".join(f"- `{package.archive(name).name}`: {_SYSTEMS[name]}" for name in platforms)
    whole = f"Drag the zip for your system into Blender's window:\n\n{zips}\n\n{changes}\n"
    (folder / NOTES).write_text(whole, encoding="utf-8", newline="\n")
    short = changelog.shorten(changes, f"All changes: {page}")
    (folder / SHORT_NOTES).write_text(short, encoding="utf-8", newline="\n")


def write_index(folder, python):
    """Let Blender's own tool list the zips of a folder for Blender (index.json) and for people (index.html)."""
    package.tool(python, "server-generate", "--html", "--repo-dir", folder)
    index = json.loads((folder / "index.json").read_text(encoding="utf-8"))
    listed = {item["archive_url"].rpartition("/")[2] for item in index["data"]}
    left_out = sorted(path.name for path in folder.glob("*.zip") if path.name not in listed)
    if left_out:  # of which the tool tells by words only
        sys.exit(f"index.json does not list {', '.join(left_out)}")


def write_sums(folder):
    """Write the SHA-256 sums of all files of a folder, as `sha256sum --check` reads them."""
    lines = [f"{package.sha256(path)}  {path.name}\n" for path in sorted(folder.iterdir()) if path.name != SUMS]
    (folder / SUMS).write_text("".join(lines), encoding="utf-8", newline="\n")


def make(version, page="", untested=""):
    """Make a release and return its folder.

    Parameters
    ----------
    version : str
    page : str
        Address of the whole notes; the website of the manifest unless given.
    untested : str
        Why the tests are not run; "" runs all that can run here.
    """
    check_tree()
    with kept(MANIFEST, CHANGELOG):
        notes, manifest = set_version(version), package.read_manifest()
        shutil.rmtree(STAGE, ignore_errors=True)
        STAGE.mkdir(parents=True)
        write_notes(STAGE, notes, page or manifest["website"], untested)
        if not untested:
            run([sys.executable, "-B", "scripts/run_tests.py", "--all"])
        zips = package.build(manifest["platforms"], STAGE)
        for path in zips:
            package.validate(path)
        check_licenses(zips, build_wheel(STAGE))
        write_index(STAGE, newest_blender())
        write_sums(STAGE)
        folder = package.OUTPUT / version
        shutil.rmtree(folder, ignore_errors=True)
        folder.parent.mkdir(exist_ok=True)
        shutil.move(STAGE, folder)
    return folder


def main():
    """Make a release, and say what is left to do."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("version", help="three numbers, such as 1.2.3")
    parser.add_argument("--page", default="", help="address of the whole release notes (default: the website)")
    parser.add_argument("--untested", default="", metavar="WHY", help="do not run the tests; the notes say why")
    arguments = parser.parse_args()
    try:
        folder = make(arguments.version, arguments.page, arguments.untested)
    except changelog.ChangelogError as error:
        sys.exit(str(error))
    for path in sorted(folder.iterdir()):
        print(f"{path.relative_to(ROOT)}: {path.stat().st_size / 1e6:.2f} MB")
    print(f"Next, see docs/releasing.md: commit {MANIFEST.name} and {CHANGELOG.name}, tag v{arguments.version}, push")


if __name__ == "__main__":
    pythons.use_supported()
    main()
