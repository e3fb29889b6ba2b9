"""Blender installs and updates the extension from a server that has the folder of a release."""

import json
import sys

import pytest

import package
import release
from tests.blender.test_package import run_apart
from tests.repository import OLDER, make_older, served

SCRIPT = """
import shutil
import sys
import tomllib
from pathlib import Path
import bpy

address, folder, newer = sys.argv[1], *map(Path, sys.argv[2:])
bpy.ops.wm.read_factory_settings(use_empty=True)
import bl_pkg  # an add-on, whose folder is known from now on

bpy.context.preferences.system.use_online_access = True
installed = Path(bpy.utils.user_resource("EXTENSIONS")) / "studio" / "meshfree_laplacian"


def extension(*words):
    code = bl_pkg.cli_extension([*words])
    enabled = [name for name in bpy.context.preferences.addons.keys() if "meshfree" in name]
    manifest = installed / "blender_manifest.toml"
    version = tomllib.loads(manifest.read_text())["version"] if manifest.exists() else None
    print("RESULT", words[0], code, version, *enabled)


extension("repo-add", "--url", address, "--clear-all", "studio")
extension("install", "--sync", "--enable", "studio.meshfree_laplacian")
next(folder.glob("*.zip")).unlink()
shutil.copy(newer, folder)
extension("server-generate", "--repo-dir", str(folder))
extension("update", "--sync")
bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4)
bpy.ops.meshfree.analyze()
print("AREA", bpy.context.object.meshfree.total_area)
extension("remove", "studio.meshfree_laplacian")
"""


def test_the_index_names_the_zips_as_they_are(archive, tmp_path):
    (tmp_path / archive.name).write_bytes(archive.read_bytes())
    release.write_index(tmp_path, sys.executable)
    (item,) = json.loads((tmp_path / "index.json").read_text(encoding="utf-8"))["data"]
    manifest = package.read_manifest()
    assert {name: item[name] for name in ("id", "version", "website")} == {
        name: manifest[name] for name in ("id", "version", "website")
    }
    assert item["platforms"] == [package.this_platform()]
    assert item["archive_url"] == f"./{archive.name}"
    assert item["archive_size"] == archive.stat().st_size
    assert item["archive_hash"] == f"sha256:{package.sha256(archive)}"
    assert f'href="./{archive.name}?' in (tmp_path / "index.html").read_text(encoding="utf-8")


def test_a_zip_that_the_index_leaves_out_is_told(tmp_path):
    (tmp_path / "broken.zip").write_text("no zip")
    with pytest.raises(SystemExit, match="does not list broken.zip"):
        release.write_index(tmp_path, sys.executable)


def test_blender_installs_updates_and_removes_it(archive, tmp_path):
    folder = tmp_path / "served"
    folder.mkdir()
    make_older(archive, folder / "older.zip")
    release.write_index(folder, sys.executable)
    with served(folder) as (address, asked):
        lines = run_apart(tmp_path, SCRIPT, address, folder, archive)
    now, enabled = package.read_manifest()["version"], "bl_ext.studio.meshfree_laplacian"
    assert [line for line in lines if line.startswith("RESULT")] == [
        "RESULT repo-add 0 None",
        f"RESULT install 0 {OLDER} {enabled}",
        f"RESULT server-generate 0 {OLDER} {enabled}",
        f"RESULT update 0 {now} {enabled}",
        "RESULT remove 0 None",
    ], lines
    (area,) = [float(line.split()[1]) for line in lines if line.startswith("AREA")]
    assert 12.0 < area < 12.6  # of a sphere by 642 points
    assert asked == ["/v1/index.json", "/v1/older.zip", "/v1/index.json", f"/v1/{archive.name}"]
