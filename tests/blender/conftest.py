"""The tests run the installed extension: the zip of this machine's platform, in a user folder of its own."""

import importlib
import importlib.util
import os
import pickle
import shutil
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from weakref import WeakKeyDictionary

import pytest

import package

MODULE = "bl_ext.user_default.meshfree_laplacian"

if importlib.util.find_spec("bpy") is None:
    collect_ignore_glob = ["test_*.py"]  # an environment without Blender: only the tests of core
else:
    USER_FOLDER = Path(tempfile.mkdtemp(prefix="meshfree-"))
    os.environ["BLENDER_USER_RESOURCES"] = str(USER_FOLDER)  # before the first import of bpy


@pytest.fixture(scope="session", autouse=True)
def installed(archive):
    """Install the built zip, enabled; disable it at the end, for Blender does not exit well with its classes."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.extensions.package_install_files(filepath=str(archive), repo="user_default", enable_on_install=True)
    assert MODULE in bpy.context.preferences.addons, "the extension is not enabled, see the output above"
    yield USER_FOLDER
    bpy.ops.preferences.addon_disable(module=MODULE)
    shutil.rmtree(USER_FOLDER, ignore_errors=True)


@pytest.fixture(scope="session")
def archive():
    """Zip of this machine's platform, made by `make build` or `make test`."""
    path = package.archive(package.this_platform())
    assert path.exists(), f"{path.name} is missing in dist/, `make build` makes it"
    return path


def part(name):
    """Return a module of the installed extension."""
    return importlib.import_module(f"{MODULE}.{name}")


def new_file():
    """Start from an empty scene."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True)


@pytest.fixture(scope="session", autouse=True)
def known_results(installed):
    """Keep what was computed when another file is opened, for many tests use the same clouds, and weigh none of it.

    Tests of the computation itself empty the cache, by its fixture; test_cache.py tries that another file does so.
    """
    import bpy

    cache, kept = part("operators.running.cache"), {}
    put = cache._put

    @bpy.app.handlers.persistent
    def keep(*_):
        kept.update(cache._kept)

    @bpy.app.handlers.persistent
    def take(*_):
        cache._kept.update(kept)
        kept.clear()

    handlers = bpy.app.handlers
    handlers.load_pre.insert(0, keep)
    handlers.load_post.insert(0, take)
    cache._put = cache._kept.__setitem__
    yield SimpleNamespace(keep=keep, put=put)
    cache._put = put
    handlers.load_pre.remove(keep)
    handlers.load_post.remove(take)


@pytest.fixture(scope="session", autouse=True)
def known_operators(installed):
    """Build each operator only once, and the narrow one by which tools solve once for each operator that is kept.

    Where it is known its stages are told again, and it has nothing that was computed of it. Yield a switch of that.
    """
    switch, known, narrow_ones = SimpleNamespace(on=True), {}, WeakKeyDictionary()
    module = part("core.operator.laplacian")
    build = module.build_laplacian

    @part("core.progress").ends_at_one
    def build_once(*given, progress=None, **named):
        if not switch.on:
            return build.__wrapped__(*given, progress=progress, **named)
        report, key = progress or (lambda stage, fraction: None), pickle.dumps((given, named))
        if key not in known:
            stages = []

            def tell(*stage):
                stages.append(stage)
                report(*stage)

            known[key] = build.__wrapped__(*given, progress=tell, **named), stages
        else:
            for stage in known[key][1]:
                report(*stage)
        return replace(known[key][0])

    for place in [found for name, found in sys.modules.items() if name.startswith(MODULE)]:
        if vars(place).get("build_laplacian") is build:  # others import it later
            place.build_laplacian = build_once
    deformation = part("core.deform.deformation")
    narrow_laplacian = deformation.narrow_laplacian

    def narrow(laplacian, *settings, progress=None):
        results = narrow_ones.setdefault(laplacian, {})
        if settings not in results:
            results[settings] = narrow_laplacian(laplacian, *settings, progress=progress)
        return results[settings]

    deformation.narrow_laplacian = narrow
    yield switch
    deformation.narrow_laplacian = narrow_laplacian
    switch.on = False


@pytest.fixture(scope="session", autouse=True)
def known_nodes(installed, tmp_path_factory):
    """Take the nodes of the display, once they are made, from a file; return the function that makes them."""
    import bpy

    nodes, path = part("ui.nodes"), tmp_path_factory.mktemp("nodes") / "display.blend"
    make = nodes._new_display

    def take():
        if not path.exists():
            group = make()
            bpy.data.libraries.write(str(path), {group})
            return group
        with bpy.data.libraries.load(str(path)) as (found, wanted):
            wanted.node_groups = found.node_groups
        bpy.data.libraries.remove(bpy.data.libraries[path.name])
        return wanted.node_groups[0]

    nodes._new_display = take
    yield make
    nodes._new_display = make


@pytest.fixture(autouse=True)
def empty_scene(installed):
    """Start every test from an empty scene."""
    import bpy

    new_file()
    assert MODULE in bpy.context.preferences.addons


@pytest.fixture
def extension(installed):
    """Root module of the installed extension."""
    return importlib.import_module(MODULE)


def _module(name):
    """Make a fixture of a module of the extension."""
    return pytest.fixture(lambda installed: part(name))


core = _module("core")
binding = _module("operators.deform.binding")
live = _module("operators.deform.live")
modifiers = _module("operators.objects.modifiers")
reading = _module("operators.objects.reading")
result = _module("operators.objects.result")
stages = _module("operators.running.stages")
colormaps = _module("ui.colormaps")
display = _module("ui.display")
legends = _module("ui.legend")
overlay = _module("ui.overlay")
ticks = _module("command.ticks")
units = _module("command.units")
counting = _module("operators.objects.counting")
command = _module("operators.files.command")
options = _module("operators.objects.options")


@pytest.fixture
def cache(known_results, known_operators, monkeypatch):
    """The module that keeps what was computed, emptied; operators are built anew."""
    cache = part("operators.running.cache")
    cache.clear()
    monkeypatch.setattr(cache, "_put", known_results.put)
    monkeypatch.setattr(known_operators, "on", False)
    return cache
