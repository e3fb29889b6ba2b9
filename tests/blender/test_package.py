"""The zip: its content, its manifest, the bundled wheels, and that nothing stays behind when it is switched off."""

import html
import posixpath
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

import licenses
import manual_pages
import package
from tests.blender.conftest import part
from tests.repository import make_older


@pytest.fixture
def packed(archive):
    with zipfile.ZipFile(archive) as opened:
        yield opened


@pytest.fixture
def manifest():
    return package.read_manifest()


def manual():
    """Names of the pages of the manual in the zip."""
    pages = [path.relative_to(manual_pages.DOCS) for path in manual_pages.sources()]
    return {f"manual/{page.with_suffix('.html').as_posix()}" for page in pages}


def test_links_of_the_manual_lead_to_its_pages(packed):
    assert len(manual()) > 30
    text = {name: packed.read(name).decode() for name in manual()}
    links = [(name, link) for name, page in text.items() for link in re.findall(r'href="([^"]+)"', page)]
    assert len(links) > 100
    for name, link in links:
        if link.startswith("http"):
            continue
        place, _, part = link.partition("#")
        target = posixpath.normpath(posixpath.join(posixpath.dirname(name), place)) if place else name
        assert target in text, (name, link)
        assert not part or f'id="{part}"' in text[target], (name, link)


def test_the_manual_holds_all_words_of_its_pages(packed):
    """Without their code, tables and pictures: nothing of the marks is left, and no paragraph."""
    for path in manual_pages.sources():
        name = f"manual/{path.relative_to(manual_pages.DOCS).with_suffix('.html').as_posix()}"
        page = html.unescape(re.sub(r"<[^>]+>", "", packed.read(name).decode().partition("<body>")[2]))
        text = path.read_text(encoding="utf-8")
        text = re.sub(r"^```.*?^```$|^\|[-| ]+\|$|!\[[^]]*\]\([^)]*\)", "", text, flags=re.MULTILINE | re.DOTALL)
        text = re.sub(r"\[([^]]+)\]\([^)]+\)", r"\1", text)
        wanted = re.findall(r"\w{4,}", text)
        assert [word for word in wanted if word not in page] == [], path.name
        assert "](" not in page
        assert "**" not in re.sub(r"<pre>.*?</pre>", "", page)


def test_the_preferences_open_the_manual(extension):
    opened = part("ui.preferences").MANUAL
    assert opened.is_file()
    assert opened.name == manual_pages.START
    texts = []
    button = SimpleNamespace(url="")

    def operator(idname, text, icon):
        texts.append((idname, text))
        return button

    preferences = bpy.context.preferences.addons[extension.__name__].preferences
    type(preferences).draw(SimpleNamespace(layout=SimpleNamespace(operator=operator)), bpy.context)
    assert texts == [("wm.url_open", "Open the Manual")]
    assert button.url == opened.as_uri()


def test_zip_holds_the_package_of_this_tree_and_nothing_else(packed, manifest):
    sources = [package.ROOT / name for name in package.PACKAGE]
    code = [path for source in sources for pattern in ("*.py", "*.pyi") for path in source.rglob(pattern)]
    files = [*code, *filter(Path.is_file, sources)]
    wheels = {f"wheels/{name}" for name in package.wheel_names(package.this_platform())}
    names = {path.relative_to(package.ROOT).as_posix() for path in files}
    assert sorted(packed.namelist()) == sorted(names | wheels | manual())
    for name in names - {"blender_manifest.toml"}:
        assert packed.read(name) == (package.ROOT / name).read_bytes(), f"{name} changed since the zip was built"


def test_manifest_of_zip_names_only_the_wheels_inside(packed, manifest):
    text = packed.read("blender_manifest.toml").decode()
    assert text.startswith((package.ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    generated = tomllib.loads(text)["build"]["generated"]
    assert generated["platforms"] == [package.this_platform()]
    wheels = {name.removeprefix("./") for name in generated["wheels"]}
    assert wheels == {name for name in packed.namelist() if name.endswith(".whl")}


def test_blender_validates_zip(archive):
    package.tool(sys.executable, "validate", archive)


def test_every_bundled_wheel_has_a_pinned_hash(archive, packed, tmp_path):
    wheels = [name for name in packed.namelist() if name.endswith(".whl")]
    sums = {package.sha256(Path(packed.extract(name, tmp_path))) for name in wheels}
    assert len(sums) == len(wheels) == 6
    assert sums <= package.pinned_hashes()


PARTS = {  # of a wheel, some of whose licenses are to be found
    "laspy": ["SPDX:BSD-2-Clause", "SPDX:BSD-3-Clause"],
    "lazrs": ["SPDX:Apache-2.0", "SPDX:MIT"],
    "scipy": ["SPDX:BSD-3-Clause", "SPDX:GPL-3.0-or-later", "SPDX:LGPL-2.1-or-later"],
    "threadpoolctl": ["SPDX:BSD-3-Clause"],
}


def test_manifest_names_the_licenses_of_all_that_the_wheels_bring(packed, manifest, tmp_path):
    seen = []
    for name in packed.namelist():
        if name.endswith(".whl"):
            path = Path(packed.extract(name, tmp_path))
            project = path.name.partition("-")[0]
            assert licenses.unnamed(path, manifest["license"]) == []
            assert set(PARTS[project]) <= set().union(*licenses.of_wheel(path))
            with zipfile.ZipFile(path) as wheel:
                (about,) = [wheel.read(item).decode() for item in wheel.namelist() if item.endswith("info/METADATA")]
            assert re.findall(r"^Requires-Dist: ([a-z_-]+)[^;]*$", about, re.MULTILINE) in ([], ["numpy"])
            seen.append(project)
    assert sorted(seen) == ["laspy", "lazrs", "lazrs", "scipy", "scipy", "threadpoolctl"]


def test_every_platform_and_python_has_its_pinned_wheels(manifest):
    names = {name for platform in manifest["platforms"] for name in package.wheel_names(platform)}
    assert len(names) == len(manifest["wheels"]) == len(package.pinned_hashes()) == 16
    for platform in manifest["platforms"]:
        wheels = [name.split("-")[::2][:2] for name in package.wheel_names(platform)]
        pythons = ["cp311"] if platform == "macos-x64" else ["cp311", "cp313"]
        compiled = [[project, python] for project in ("scipy", "lazrs") for python in pythons]
        assert sorted(wheels) == sorted([*compiled, ["laspy", "py3"], ["threadpoolctl", "py3"]])


def test_it_asks_for_no_newer_blender_than_those_of_the_tests(manifest):
    assert tuple(map(int, manifest["blender_version_min"].split("."))) <= bpy.app.version


def test_scipy_is_the_bundled_one(installed, core):
    import scipy

    assert scipy.__version__ == "1.15.3"
    assert Path(scipy.__file__).is_relative_to(installed)
    assert Path(core.__file__).is_relative_to(installed)


def test_numpy_is_blenders_own(installed):
    import numpy

    assert not Path(numpy.__file__).is_relative_to(installed)


WITHOUT_SCIPY = """
import sys
from importlib.machinery import PathFinder
import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)
find = PathFinder.find_spec
PathFinder.find_spec = lambda name, *rest: None if name.partition(".")[0] == "scipy" else find(name, *rest)
bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)

def told():
    found = [name for name in dir(bpy.types) if "MESHFREE" in name], hasattr(bpy.types.Object, "meshfree")
    print("RESULT", *found, [name for name in bpy.context.preferences.addons.keys() if "meshfree" in name])

told()
bpy.ops.preferences.addon_disable(module="bl_ext.user_default.meshfree_laplacian")
told()
"""


def run_apart(tmp_path, script, *arguments):
    """Run a script in a Blender of its own, with an empty user folder; return the lines that it writes."""
    (tmp_path / "script.py").write_text(script)
    (tmp_path / "user").mkdir()
    done = subprocess.run(
        [sys.executable, str(tmp_path / "script.py"), *map(str, arguments)],
        env={"BLENDER_USER_RESOURCES": str(tmp_path / "user"), "PATH": "", "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    return (done.stdout + done.stderr).splitlines()


def test_without_a_scipy_for_this_python_it_says_so(archive, tmp_path):
    """Nothing but a panel is registered, with one line in the console, and it can be switched off."""
    lines = run_apart(tmp_path, WITHOUT_SCIPY, archive)
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    told = f"Mesh-Free Laplacian does nothing here: it brings no scipy for Python {python}. Get a newer version of it,"
    assert len([line for line in lines if line.startswith(told)]) == 1
    assert not [line for line in lines if "Traceback" in line or "Exception" in line]
    assert [line for line in lines if line.startswith("RESULT")] == [
        "RESULT ['MESHFREE_PT_missing'] False ['bl_ext.user_default.meshfree_laplacian']",
        "RESULT [] False []",
    ]


START = """
import sys
import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)
print("RESULT", *(name for name in sys.modules if ".meshfree_laplacian.core" in name))
HEAVY = "scipy", "threadpoolctl", "laspy", "lazrs"
print("HEAVY", *(name for name in sys.modules if name.partition(".")[0] in HEAVY))
operator = sys.modules["bl_ext.user_default.meshfree_laplacian.operators.running.job"].JobOperator
work = operator.work

def noted(self, *given):
    print("PLANNED", *(name for name in sys.modules if name.partition(".")[0] in HEAVY))
    return work(self, *given)

operator.work = noted
bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5)
print("RUN", bpy.ops.meshfree.analyze(modes=0))
print("THEN", len([name for name in sys.modules if name.partition(".")[0] == "scipy"]) > 100)
"""
LIGHT = {
    f"core.{name}" for name in ("arguments", "control_groups", "errors", "linalg", "memory", "options", "types")
} | {"core"}


def test_blender_starts_without_what_only_the_tools_need(archive, tmp_path):
    """Of core only errors, options and the kinds of files are imported before a tool runs; scipy takes a second.

    A tool that has read the points takes it in its own thread, where the window goes on and Esc is heard.
    """
    lines = {line.split(" ")[0]: line.split(" ")[1:] for line in run_apart(tmp_path, START, archive)}
    names = {name.partition(".meshfree_laplacian.")[2] for name in lines["RESULT"]}
    assert names >= {"core", "core.errors"}
    assert [name for name in names if name not in LIGHT and not name.startswith("core.files")] == []
    assert lines["HEAVY"] == lines["PLANNED"] == []
    assert lines["RUN"] == ["{'FINISHED'}"]
    assert lines["THEN"] == ["True"]


OTHER_SCIPY = """
import sys
import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)
for path in sys.argv[1:]:
    bpy.ops.extensions.package_install_files(filepath=path, repo="user_default", enable_on_install=True)
import scipy
print("RESULT", scipy.__version__, [name for name in dir(bpy.types) if "MESHFREE_PT" in name])
"""
MANIFEST = """
schema_version = "1.0.0"
id = "other"
version = "1.0.0"
name = "Other"
tagline = "Another extension that brings a scipy"
maintainer = "nobody"
type = "add-on"
blender_version_min = "4.2.0"
license = ["SPDX:GPL-3.0-or-later"]
wheels = ["./wheels/{}"]
"""


def other_extension(path, scipy, files):
    """Make the zip of an extension that brings a scipy of some version, given by its files."""
    wheel, information = path.parent / f"scipy-{scipy}-py3-none-any.whl", f"scipy-{scipy}.dist-info"
    files = files | {
        f"{information}/METADATA": f"Metadata-Version: 2.1\nName: scipy\nVersion: {scipy}\n",
        f"{information}/WHEEL": "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    record = "".join(f"{name},,\n" for name in [*files, f"{information}/RECORD"])
    with zipfile.ZipFile(wheel, "w") as opened:
        for name, text in (files | {f"{information}/RECORD": record}).items():
            opened.writestr(name, text)
    with zipfile.ZipFile(path, "w") as opened:
        opened.writestr("blender_manifest.toml", MANIFEST.format(wheel.name))
        opened.writestr("__init__.py", "def register():\n    pass\n\n\ndef unregister():\n    pass\n")
        opened.write(wheel, f"wheels/{wheel.name}")
    return path


def test_where_another_scipy_does_not_serve_it_says_so(archive, tmp_path):
    """Blender takes the newest of all that extensions bring."""
    other = other_extension(tmp_path / "other.zip", "99.0", {"scipy/__init__.py": "__version__ = '99.0'\n"})
    lines = run_apart(tmp_path, OTHER_SCIPY, other, archive)
    assert "RESULT 99.0 ['MESHFREE_PT_missing']" in lines
    assert len([line for line in lines if "scipy 99.0, which something else brings, does not serve it." in line]) == 1
    assert not [line for line in lines if "Traceback" in line]


def test_an_older_scipy_of_another_extension_does_not_matter(archive, tmp_path):
    other = other_extension(tmp_path / "other.zip", "0.1", {"scipy/__init__.py": "__version__ = '0.1'\n"})
    (line,) = [line for line in run_apart(tmp_path, OTHER_SCIPY, other, archive) if line.startswith("RESULT")]
    assert line.startswith("RESULT 1.15.3 ")
    assert "MESHFREE_PT_missing" not in line


BROKEN_SCIPY = """
import sys
import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)
for path in sys.argv[1:]:
    bpy.ops.extensions.package_install_files(filepath=path, repo="user_default", enable_on_install=True)
bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4)
try:
    bpy.ops.meshfree.analyze()
except RuntimeError as error:
    print("RESULT", error)
"""


def test_a_scipy_that_only_looks_fit_is_told_by_the_tool(archive, tmp_path):
    """It has the version of ours, and is not tried when Blender starts."""
    other = other_extension(tmp_path / "other.zip", "1.15.99", {"scipy/__init__.py": "__version__ = '1.15.99'\n"})
    lines = run_apart(tmp_path, BROKEN_SCIPY, other, archive)
    (line,) = [line for line in lines if line.startswith("RESULT")]
    assert re.search(r"The scipy of this Python does not serve: .*'scipy(\.\w+)?'", line)
    assert "Disable the extension that brings another one, or install this one again; then restart." in line
    assert not [line for line in lines if "Traceback" in line]


LIFE = """
import sys
from pathlib import Path
import bpy

NAME = "bl_ext.user_default.meshfree_laplacian"
bpy.ops.wm.read_factory_settings(use_empty=True)
user = Path(bpy.utils.resource_path("USER"))


def install(path):
    bpy.ops.extensions.package_install_files(filepath=path, repo="user_default", enable_on_install=True)


def ours():
    return sorted(path.name for path in (user / "extensions").rglob("*meshfree*"))


install(sys.argv[1])
obj = bpy.data.objects.new("Cloud", bpy.data.meshes.new("Cloud"))
obj.meshfree.neighbors = 33
folder = user / "extensions/user_default/meshfree_laplacian"
print("OLD", (folder / "core/former.py").exists())
install(sys.argv[2])
print("NEW", (folder / "core/former.py").exists(), obj.meshfree.neighbors, NAME in bpy.context.preferences.addons)
bpy.ops.preferences.addon_disable(module=NAME)
bpy.ops.preferences.addon_enable(module=NAME)
print("AGAIN", obj.meshfree.neighbors, len([name for name in dir(bpy.types) if name == "MESHFREE_OT_analyze"]))
index = next(i for i, repo in enumerate(bpy.context.preferences.extensions.repos) if repo.module == "user_default")
bpy.ops.extensions.package_uninstall(repo_index=index, pkg_id="meshfree_laplacian")
left = [name for name in dir(bpy.types) if "MESHFREE" in name]
print("GONE", ours(), left, NAME in bpy.context.preferences.addons, list((user / "extensions").rglob("scipy")))
"""


def test_it_takes_the_place_of_an_older_version_and_leaves_nothing(archive, tmp_path):
    older = tmp_path / "older.zip"
    make_older(archive, older, **{"core/former.py": ""})
    lines = run_apart(tmp_path, LIFE, older, archive)
    assert [line for line in lines if line.split(" ")[0] in ("OLD", "NEW", "AGAIN", "GONE")] == [
        "OLD True",
        "NEW False 33 True",
        "AGAIN 33 1",
        "GONE [] [] False []",
    ]
    assert not [line for line in lines if "Traceback" in line]
