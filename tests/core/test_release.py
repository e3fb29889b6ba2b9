"""A release: the version in one place, its notes, sums and licenses, and that a failed one changes nothing."""

import struct
import subprocess
import tomllib
import zipfile

import pytest

import licenses
import package
import release

MANIFEST = 'schema_version = "1.0.0"\n\nid = "x"\nversion = "0.1.0"\nblender_version_min = "4.2.0"\n'
CHANGES = "# Changelog\n\n## Unreleased\n\n- New\n  things.\n\n## 0.1.0\n\n- Old.\n"
PAGE = "the page"


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """Manifest and changelog of another project, for those of this one."""
    for name, text in (("MANIFEST", MANIFEST), ("CHANGELOG", CHANGES)):
        path = tmp_path / getattr(release, name).name
        path.write_text(text)
        monkeypatch.setattr(release, name, path)
    return tmp_path


def texts(folder):
    return [path.read_text() for path in (folder / "blender_manifest.toml", folder / "CHANGELOG.md")]


def test_the_version_is_written_in_one_place_only():
    project = tomllib.loads((package.ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert "version" in project["project"]["dynamic"]
    assert project["tool"]["hatch"]["version"]["path"] == release.MANIFEST.name


def test_the_version_goes_into_manifest_and_changelog(tree):
    assert release.set_version("0.2.0") == "- New\n  things."
    assert texts(tree) == [
        MANIFEST.replace('\nversion = "0.1.0"', '\nversion = "0.2.0"'),
        CHANGES.replace("Unreleased", "0.2.0"),
    ]
    assert release.set_version("0.2.0") == "- New\n  things."


@pytest.mark.parametrize("untested", ["", "a test"])
@pytest.mark.parametrize("stop", [SystemExit, KeyboardInterrupt, ValueError])
def test_a_release_that_fails_leaves_everything_as_it_was(tree, monkeypatch, stop, untested):
    """Be it by the tests, which are run unless a reason is given, or by what is built after them."""
    called = []

    def fail(*words):
        called.append(words)
        assert '\nversion = "0.2.0"' in texts(tree)[0]
        raise stop("as a test")

    for name, value in (("STAGE", tree / "stage"), ("check_tree", lambda: None), ("write_notes", lambda *_: None)):
        monkeypatch.setattr(release, name, value)
    monkeypatch.setattr(package, "OUTPUT", tree / "dist")
    monkeypatch.setattr(package, "build", fail)
    monkeypatch.setattr(release, "run", fail)
    with pytest.raises(stop):
        release.make("0.2.0", PAGE, untested)
    assert texts(tree) == [MANIFEST, CHANGES]
    assert not (tree / "dist").exists()
    ((first, *_),) = called
    assert ("scripts/run_tests.py" in first) is not bool(untested)


def test_what_is_in_no_commit_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(release, "ROOT", tmp_path)
    monkeypatch.setattr("environments.ROOT", tmp_path)
    release.check_tree()  # no checkout: nothing to compare with
    git = ["git", "-c", "user.name=Test", "-c", "user.email=test@test"]
    for name in ("a.py", "CHANGELOG.md"):
        (tmp_path / name).write_text("first")
    for words in (["init", "--quiet"], ["add", "."], ["commit", "--quiet", "--message", "All"]):
        subprocess.run([*git, *words], cwd=tmp_path, check=True)
    (tmp_path / "CHANGELOG.md").write_text("second")
    release.check_tree()
    (tmp_path / "b.py").write_text("new")
    with pytest.raises(SystemExit, match="in no commit: b.py"):
        release.check_tree()


@pytest.mark.parametrize("untested", ["", "they passed elsewhere"])
def test_the_notes_hold_the_zips_and_the_changes(tmp_path, untested):
    notes = "Much:\n\n" + "\n".join(f"- Change\n  {i}." for i in range(200))
    release.write_notes(tmp_path, notes, PAGE, untested)
    whole, short = ((tmp_path / name).read_text() for name in (release.NOTES, release.SHORT_NOTES))
    for name in package.read_manifest()["platforms"]:
        assert f"`{package.archive(name).name}`" in whole
    assert "- Change 0.\n- Change 1.\n" in whole
    assert "- Change 199.\n" in whole
    assert "- Change 0.\n- Change 1.\n" in short
    assert short.endswith(f"\n\nAll changes: {PAGE}")
    assert len(short) <= 1024
    for text in (whole, short):
        assert (f"tests were not run by this build: {untested}." in text) is bool(untested)


def test_sums_are_those_of_the_files(tmp_path):
    (tmp_path / "empty").touch()
    (tmp_path / "abc").write_text("abc")
    release.write_sums(tmp_path)
    assert (tmp_path / release.SUMS).read_text() == (
        "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  abc\n"
        "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855  empty\n"
    )


def write_zip(path, **files):
    with zipfile.ZipFile(path, "w") as opened:
        for name, text in files.items():
            opened.writestr(name, text)
    return path


def write_wheel(path, expression, **files):
    about = {"a.dist-info/METADATA": f"Metadata-Version: 2.4\nName: a\nLicense-Expression: {expression}\n"}
    return write_zip(path, **about, **files)


TEXT = {"a.dist-info/licenses/LICENSE.txt": "All rights\n"}
BUNDLED = {"a.dist-info/licenses/LICENSE.txt": "All rights\n\nName: b\nLicense: Zlib\n"}
PARTS = """{"components": [
    {"name": "b", "licenses": [{"expression": "MIT OR 0BSD"}]},
    {"name": "unicode-ident", "licenses": [{"expression": "Unicode-3.0"}]}
]}"""


@pytest.mark.parametrize(
    ("expression", "files", "told"),
    [
        ("MIT", TEXT, []),
        ("Apache-2.0 WITH LLVM-exception OR MIT", TEXT, []),
        ("MIT", {**TEXT, "a.cyclonedx.json": PARTS}, []),
        ("MIT", BUNDLED, ["SPDX:Zlib"]),
        ("MIT", {name: text.replace("\n", "\r\n").replace("Zlib", "MIT") for name, text in BUNDLED.items()}, []),
        ("0BSD", {**TEXT, "a.cyclonedx.json": PARTS}, ["SPDX:0BSD"]),
        ("MIT", {}, ["no text"]),
    ],
)
def test_licenses_of_wheels_are_those_that_are_named(tmp_path, expression, files, told):
    path = write_wheel(tmp_path / "a.whl", expression, **files)
    found = licenses.unnamed(path, ["SPDX:MIT"])
    assert len(found) == len(told)
    assert all(word in line for word, line in zip(told, found, strict=True))


def test_a_missing_license_stops_the_release(tmp_path, monkeypatch):
    monkeypatch.setattr(package, "WHEELS", tmp_path)
    license = {"LICENSE": (package.ROOT / "LICENSE").read_text(encoding="utf-8")}
    write_wheel(tmp_path / "b.whl", "Zlib", **TEXT)
    good = write_zip(tmp_path / "good.zip", **license)
    bad = write_zip(tmp_path / "bad.zip", **{"LICENSE": "Something else", "wheels/b.whl": ""})
    wheel = write_wheel(tmp_path / "a.whl", licenses.PROJECT, **license)
    release.check_licenses([good], wheel)
    with pytest.raises(SystemExit) as told:
        release.check_licenses([good, bad], write_wheel(tmp_path / "c.whl", "MIT", **license))
    assert str(told.value).splitlines() == [
        "bad.zip does not hold LICENSE",
        "b.whl brings what is under SPDX:Zlib, which the manifest does not name",
        f"c.whl does not name {licenses.PROJECT}",
    ]


@pytest.mark.parametrize(("name", "size", "kind"), [("icon", (256, 256), 6), ("featured", (1920, 1080), 3)])
def test_pictures_for_the_platform_have_its_sizes(name, size, kind):
    """Color type 6 has transparency, 3 a palette."""
    head = (package.ROOT / "docs" / "pictures" / f"{name}.png").read_bytes()[:26]
    assert head.startswith(b"\x89PNG")
    assert struct.unpack(">II", head[16:24]) == size
    assert head[25] == kind
