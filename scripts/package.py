"""Build the extension: fetch the wheels, stage the package, pack one zip per platform with Blender's own tool."""

import argparse
import hashlib
import platform
import re
import shutil
import sys

import manual_pages
import pythons
from environments import ROOT, newest_blender, run

PACKAGE = (
    "blender_manifest.toml",
    "__init__.py",
    "core",
    "tools",
    "command",
    "operators",
    "ui",
    "LICENSE",
    "README.md",
)
WHEELS = ROOT / "build" / "wheels"
STAGE = ROOT / "build" / "package"
OUTPUT = ROOT / "dist"
PINS = ROOT / "wheels.txt"

_SYSTEMS = {"linux": "linux", "darwin": "macos", "windows": "windows"}
_MACHINES = {"x86_64": "x64", "amd64": "x64", "arm64": "arm64", "aarch64": "arm64"}


def read_manifest():
    """Content of blender_manifest.toml."""
    import tomllib  # new in Python 3.11

    return tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))


def this_platform():
    """Name of this machine's platform in Blender's words, such as linux-x64."""
    system, machine = platform.system().lower(), platform.machine().lower()
    name = f"{_SYSTEMS.get(system, system)}-{_MACHINES.get(machine, machine)}"
    supported = read_manifest()["platforms"]
    if name not in supported:
        sys.exit(f"The extension is not built for {name}, only for {', '.join(supported)}")
    return name


def archive(name, folder=OUTPUT):
    """Path of the zip for a platform."""
    manifest = read_manifest()
    return folder / f"{manifest['id']}-{manifest['version']}-{name.replace('-', '_')}.zip"


def wheel_names(name):
    """File names of the wheels that the manifest lists for a platform."""
    tags = {"linux-x64": "manylinux.*_x86_64", "windows-x64": "win_amd64"}
    tags.update({"macos-arm64": "macosx.*_arm64", "macos-x64": "macosx.*_x86_64"})
    wheels = [path.rpartition("/")[2] for path in read_manifest()["wheels"]]
    return [wheel for wheel in wheels if re.search(f"-({tags[name]}|any)\\.whl$", wheel)]


def pinned_hashes():
    """SHA-256 sums of wheels.txt."""
    return set(re.findall(r"--hash=sha256:([0-9a-f]{64})", PINS.read_text(encoding="utf-8")))


def sha256(path):
    """SHA-256 sum of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def fetch(wheels, python):
    """Fetch wheels from the package registry, unless they are there, and check their hashes."""
    for wheel in wheels:
        path = WHEELS / wheel
        if not path.exists() or sha256(path) not in pinned_hashes():
            path.unlink(missing_ok=True)
            print(f"Fetching {wheel}", flush=True)
            project, version, interpreter, abi, tags = path.stem.split("-")
            target = ["--implementation", "cp", "--python-version", interpreter[2:], "--abi", abi]
            target += ["--platform", tags.partition(".")[0]]
            run(
                [python, "-m", "pip", "download", "--quiet", "--no-input", "--disable-pip-version-check"]
                + ["--only-binary=:all:", "--no-deps", "--dest", WHEELS, f"{project}=={version}"]
                + (target if abi != "none" else [])  # which fits all
            )
        if not path.exists() or sha256(path) not in pinned_hashes():
            sys.exit(f"{wheel} is not what wheels.txt pins; compare it with the wheels in blender_manifest.toml")


def stage(platforms):
    """Copy the package and the wheels of some platforms into an empty folder.

    The wheels of the others stand there as empty files: Blender's tool packs every platform of the manifest, and so
    the zip of one platform is the same whether it was built alone or with the others.
    """
    shutil.rmtree(STAGE, ignore_errors=True)
    (STAGE / "wheels").mkdir(parents=True)
    for name in PACKAGE:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, STAGE / name, ignore=shutil.ignore_patterns("__pycache__", ".*", "py.typed"))
        elif source.exists():
            shutil.copy2(source, STAGE / name)
        else:
            sys.exit(f"{name} is missing, the package needs it")
    manual_pages.write_pages(STAGE / "manual")
    for name in read_manifest()["platforms"]:
        for wheel in wheel_names(name):
            if name in platforms:
                shutil.copy2(WHEELS / wheel, STAGE / "wheels")
            else:
                (STAGE / "wheels" / wheel).touch()


def tool(python, *arguments):
    """Run Blender's own tool for extensions in an environment with Blender."""
    script = ROOT / "scripts" / "blender_extension.py"
    run([python, script, *arguments], timeout=300, capture_output=True, text=True)


def build(platforms, output=OUTPUT):
    """Build the zips of some platforms into a folder, dist/ unless another is named, and return their paths."""
    python = newest_blender()
    for name in platforms:
        fetch(wheel_names(name), python)
    stage(platforms)
    packed = STAGE.with_name("packed")
    shutil.rmtree(packed, ignore_errors=True)
    packed.mkdir()
    tool(python, "build", "--split-platforms", "--source-dir", STAGE, "--output-dir", packed)
    output.mkdir(parents=True, exist_ok=True)
    paths = [archive(name, output) for name in platforms]
    for path in paths:
        shutil.move(packed / path.name, path)
        print(f"{path.relative_to(ROOT)}: {path.stat().st_size / 1e6:.1f} MB")
    shutil.rmtree(packed)
    shutil.rmtree(STAGE)
    return paths


def validate(path):
    """Let Blender's own tool judge a zip, and stop if it is not valid."""
    tool(newest_blender(), "validate", path)
    print(f"{path.relative_to(ROOT)}: valid")


def main():
    """Build, and validate if asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--validate", action="store_true", help="run Blender's validator on every zip")
    arguments = parser.parse_args()
    for path in build(read_manifest()["platforms"]):
        if arguments.validate:
            validate(path)


if __name__ == "__main__":
    pythons.use_supported()
    main()
