"""`blender --command extension` installs and updates the extension from a server that has the folder of a release."""

import shutil
import subprocess

import package
import release
from environments import newest_blender
from tests.repository import OLDER, make_older, served

NAME = "studio.meshfree_laplacian"


def test_the_command_line_installs_and_updates_it(place, archive, tmp_path):
    user = place.make_folder()

    def blender(*words):
        variables = {"BLENDER_USER_RESOURCES": place.inside(user), "HOME": place.inside(user)}
        command = place.command([place.blender, "--online-mode", "--command", *words], **variables)
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    try:
        make_older(archive, tmp_path / "older.zip")
        release.write_index(tmp_path, newest_blender())
        with served(tmp_path) as (address, asked):
            blender("extension", "repo-add", "--name", "Studio", "--url", address, "--clear-all", "studio")
            blender("extension", "sync")
            blender("extension", "install", "--enable", NAME)
            (tmp_path / "older.zip").unlink()
            shutil.copy(archive, tmp_path)
            release.write_index(tmp_path, newest_blender())
            listed = blender("extension", "list", "--sync")
            assert f"outdated: {OLDER} -> {package.read_manifest()['version']}" in listed
            blender("extension", "update")
        assert "analyze" in blender("meshfree", "--help")
        assert "[installed]" in blender("extension", "list")
        assert {*asked} == {"/v1/index.json", "/v1/older.zip", f"/v1/{archive.name}"}
    finally:
        shutil.rmtree(user)
