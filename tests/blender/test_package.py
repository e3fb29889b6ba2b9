"""The zip: its content, its manifest, the bundled scipy, and that nothing stays behind when it is switched off."""

import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import bpy
import pytest

import package


@pytest.fixture
def packed(archive):
    with zipfile.ZipFile(archive) as opened:
        yield opened


@pytest.fixture
def manifest():
    return package.read_manifest()


def test_zip_holds_the_package_of_this_tree_and_nothing_else(packed, manifest):
    sources = [package.ROOT / name for name in package.PACKAGE]
    files = [path for source in sources for path in ([source] if source.is_file() else source.rglob("*.py"))]
    wheels = {f"wheels/{name}" for name in package.wheel_names(package.this_platform())}
    names = {path.relative_to(package.ROOT).as_posix() for path in files}
    assert sorted(packed.namelist()) == sorted(names | wheels)
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
    assert len(sums) == len(wheels) == 2
    assert sums <= package.pinned_hashes()


def test_every_platform_and_python_has_one_pinned_wheel(manifest):
    names = [name for platform in manifest["platforms"] for name in package.wheel_names(platform)]
    assert len(names) == len(set(names)) == len(manifest["wheels"]) == len(package.pinned_hashes()) == 7
    for platform in manifest["platforms"]:
        pythons = [name.split("-")[2] for name in package.wheel_names(platform)]
        assert pythons == (["cp311"] if platform == "macos-x64" else ["cp311", "cp313"])


def test_versions_agree(manifest):
    project = tomllib.loads((package.ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert manifest["version"] == project["version"]
    assert tuple(map(int, manifest["blender_version_min"].split("."))) <= bpy.app.version


def test_scipy_is_the_bundled_one(installed, core):
    import scipy

    assert scipy.__version__ == "1.15.3"
    assert Path(scipy.__file__).is_relative_to(installed)
    assert Path(core.__file__).is_relative_to(installed)


def test_numpy_is_blenders_own(installed):
    import numpy

    assert not Path(numpy.__file__).is_relative_to(installed)


def _registered():
    """Everything that an extension may add to Blender, by name."""
    handlers = [
        f"{name}: {function.__module__}"
        for name in dir(bpy.app.handlers)
        if isinstance(functions := getattr(bpy.app.handlers, name), list)
        for function in functions
    ]
    return {
        "types": [name for name in dir(bpy.types) if "meshfree" in name.lower()],
        "operators": dir(bpy.ops.meshfree),
        "handlers": handlers,
        **{
            f"properties of {owner.__name__}": sorted(owner.bl_rna.properties.keys())
            for owner in (bpy.types.Object, bpy.types.Scene, bpy.types.Mesh, bpy.types.WindowManager)
        },
    }


def test_switching_off_and_on_leaves_nothing_behind(extension):
    name = extension.__name__
    enabled = _registered()
    assert "MESHFREE_OT_analyze" in enabled["types"]
    try:
        bpy.ops.preferences.addon_disable(module=name)
        disabled = _registered()
        assert disabled["types"] == []
        assert disabled["operators"] == []
        assert "meshfree" not in disabled["properties of Object"]
        assert not [handler for handler in disabled["handlers"] if name in handler]
        bpy.ops.preferences.addon_enable(module=name)
        assert _registered() == enabled
        bpy.ops.preferences.addon_disable(module=name)
        assert _registered() == disabled
    finally:
        bpy.ops.preferences.addon_enable(module=name)
    assert _registered() == enabled


WITHOUT_SCIPY = """
import sys
import bpy

class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name == "scipy" or name.startswith("scipy."):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

bpy.ops.wm.read_factory_settings(use_empty=True)
sys.meta_path.insert(0, Hidden())
bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)

def told():
    found = [name for name in dir(bpy.types) if "MESHFREE" in name], hasattr(bpy.types.Object, "meshfree")
    print("RESULT", *found, [name for name in bpy.context.preferences.addons.keys() if "meshfree" in name])

told()
bpy.ops.preferences.addon_disable(module="bl_ext.user_default.meshfree_laplacian")
told()
"""


def test_without_a_scipy_for_this_python_it_says_so(archive, tmp_path):
    """Nothing but a panel is registered, with one line in the console, and it can be switched off."""
    (tmp_path / "without.py").write_text(WITHOUT_SCIPY)
    (tmp_path / "user").mkdir()
    done = subprocess.run(
        [sys.executable, str(tmp_path / "without.py"), str(archive)],
        env={"BLENDER_USER_RESOURCES": str(tmp_path / "user"), "PATH": "", "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    lines = (done.stdout + done.stderr).splitlines()
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    told = f"Mesh-Free Laplacian does nothing here: it brings no scipy for Python {python}. Get a newer version of it,"
    assert len([line for line in lines if line.startswith(told)]) == 1
    assert not [line for line in lines if "Traceback" in line or "Exception" in line]
    assert [line for line in lines if line.startswith("RESULT")] == [
        "RESULT ['MESHFREE_PT_missing'] False ['bl_ext.user_default.meshfree_laplacian']",
        "RESULT [] False []",
    ]
