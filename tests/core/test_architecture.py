"""The arrows of the house: ui -> operators -> command -> tools -> core, and between packages of core; no bpy below."""

import ast
import functools
import re
import subprocess
import sys
import tomllib
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import core
from benchmarks.ablation import constants

ROOT = Path(__file__).parents[2]
PUBLIC = [
    "LaplacianOptions",
    "build_laplacian",
    "LaplaceBeltrami",
    "estimate_areas",
    "estimate_normals",
    "PointCloudError",
]


@functools.cache
def imported(path):
    """Names of the modules that a file imports, relative ones with their dots."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            stem = "." * node.level + (node.module or "")
            found += [f"{stem}{'' if stem.endswith('.') else '.'}{alias.name}" for alias in node.names]
    return found


def taken(path):
    """Names that a file of Blender's side takes from core as ``core.name``, annotations in quotes included."""
    return re.findall(r"(?<![.\w])core((?:\.\w+)+)", path.read_text(encoding="utf-8"))


ABOVE = "tools", "command", "operators", "ui"
BLENDER_SIDE = sorted(path for package in ABOVE for path in (ROOT / package).rglob("*.py"))
LIGHT = ("arguments", "errors", "files", "linalg", "memory", "options")  # modules and packages of core without scipy


@pytest.mark.parametrize(
    ("package", "forbidden"),
    [
        ("core", {"bpy", "tools", "command", "operators", "ui"}),
        ("tools", {"bpy", "command", "operators", "ui"}),
        ("command", {"bpy", "operators", "ui"}),
        ("operators", {"ui"}),
    ],
)
def test_imports_point_one_way(package, forbidden):
    files = sorted((ROOT / package).rglob("*.py"))
    assert files
    found = {(file.name, name) for file in files for name in imported(file)}
    assert {(file, name) for file, name in found if name.lstrip(".").split(".")[0] in forbidden} == set()


def test_no_imports_go_in_a_circle_not_even_for_types():
    packages = ("core", *ABOVE)
    paths = {path.relative_to(ROOT).with_suffix(""): path for name in packages for path in (ROOT / name).rglob("*.py")}
    modules = {".".join(path.parts).removesuffix(".__init__"): file for path, file in paths.items()}

    def known(name):
        """Return the module that holds a name, or that it is."""
        return name if name in modules else name.rpartition(".")[0]

    arrows = {}
    for module, file in modules.items():
        inside = module.split(".") if file.name == "__init__.py" else module.split(".")[:-1]
        names = [(len(name) - len(name.lstrip(".")), name.lstrip(".")) for name in imported(file)]
        found = {known(".".join([*inside[: len(inside) + 1 - dots], name] if dots else [name])) for dots, name in names}
        arrows[module] = found & modules.keys() - {module}
    assert sum(map(len, arrows.values())) > 1000
    TopologicalSorter(arrows).prepare()  # raises CycleError, which names the modules


OPERATORS = {  # what each package may import, beside itself and core
    "objects": (),
    "running": ("objects.",),
    "tools": ("objects.", "running."),
    "deform": ("objects.", "running.", "tools.select."),  # for the base class of what works on selected points
    "rigging": ("objects.", "running.", "deform.", "tools.select"),  # for what is done with selected points
    "files": ("objects.", "running.", "tools.", "rigging."),  # for the command line, which runs them
}


def test_operators_have_these_packages():
    assert {file.parent.name for file in (ROOT / "operators").glob("*/*.py")} == OPERATORS.keys()


@pytest.mark.parametrize("package", OPERATORS)
def test_packages_of_operators_point_one_way(package):
    files = sorted((ROOT / "operators" / package).glob("*.py"))
    found = {(file.name, name) for file in files for name in imported(file) if name.startswith("..")}
    inside, below = ("..registration", *(f"..{name}" for name in OPERATORS[package])), ("command", "core", "tools")
    allowed = (*inside, *(f"...{name}" for name in below))
    assert {(file, name) for file, name in found if not name.startswith(allowed)} == set()


def test_nothing_heavy_is_imported_before_it_is_needed():
    """Blender imports all of operators and ui as it starts: they take what needs scipy as ``core.name``, when they run.

    But for the panel that tells which scipy there is.
    """
    light = {name for name, home in core._HOMES.items() if home in LIGHT}
    files = [path for path in BLENDER_SIDE if path.name != "missing.py"]
    names = [(path.name, name.lstrip(".").split(".")) for path in files for name in imported(path)]
    heavy = [
        (file, *parts)
        for file, parts in names
        if parts[0] == "scipy" or (parts[0] == "core" and len(parts) > 1 and parts[1] not in (*LIGHT, *light))
    ]
    assert heavy == []


def test_light_parts_of_core_import_no_scipy():
    code = f"import sys, {', '.join(f'core.{name}' for name in LIGHT)}; assert 'scipy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_what_is_taken_from_core_is_public_or_listed_by_a_package():
    names = {name[1:] for path in BLENDER_SIDE for name in taken(path)}
    assert len(names) > 40
    lists = {package: core._read(f"{package}/__init__.py") for package in BELOW}
    assert names <= {*core.__all__, *(f"{package}.{name}" for package, listed in lists.items() for name in listed)}


@pytest.mark.parametrize("call", [r"\blayout\b", r"\bdef draw", r"\bbpy\.ops\.meshfree\."])
def test_operators_draw_nothing_and_call_no_operator(call):
    """What they have to say goes to those that listen, see operators/objects/handlers.py."""
    files = sorted((ROOT / "operators").rglob("*.py"))
    assert [file.name for file in files if re.search(call, file.read_text(encoding="utf-8"))] == []


GROUND = {
    "arguments",
    "control_groups",
    "cores",
    "errors",
    "frozen",
    "kernel",
    "linalg",
    "memory",
    "options",
    "progress",
    "types",
}
TOPICS = {  # what the operator is for, and the other topics that each truly builds on
    "clean": (),
    "deform": (),
    "distance": (),
    "measure": ("distance", "surface"),
    "motion": (),
    "rig": ("motion",),
    "spectral": (),
    "surface": (),
}
BELOW = {  # what each package of core may use
    "algebra": {"cores", "errors", "linalg", "types"},
    "geometry": GROUND | {"algebra"},
    "operator": GROUND | {"algebra", "geometry"},
    "paper": GROUND | {"algebra", "geometry", "operator"},
    "tiles": GROUND | {"clean", "files", "geometry", "operator"},
    "files": GROUND,
    "splats": GROUND | {"algebra", "files"},
} | {topic: GROUND | {"algebra", "geometry", "operator", *others} for topic, others in TOPICS.items()}


def modules_of(package):
    return sorted(path for path in (ROOT / "core" / package).rglob("*.py") if path.name != "__init__.py")


@pytest.mark.parametrize("package", BELOW)
def test_packages_of_core_use_what_is_below_them_by_its_list(package):
    """``..geometry`` gives what `core/geometry/__init__.py` lists; its modules are its own."""
    assert len(modules_of(package)) > 2
    wrong = []
    for path in modules_of(package):
        names = [name.removeprefix("..") for name in imported(path) if name.startswith("..")]
        wrong += [
            f"{path.name}: {name}"
            for name in names
            if name.split(".")[0] not in BELOW[package] or (name.split(".")[0] in BELOW and name.count(".") != 1)
        ]
    assert wrong == []


def test_the_ground_uses_nothing_above():
    names = [name for stem in GROUND for name in imported(ROOT / "core" / f"{stem}.py") if name.startswith(".")]
    assert {name.split(".")[1] for name in names} <= GROUND


def test_topics_build_on_no_more_of_each_other_than_is_told():
    found = {
        (topic, name.split(".")[2])
        for topic in TOPICS
        for path in modules_of(topic)
        for name in imported(path)
        if name.startswith("..") and name.split(".")[2] in TOPICS
    }
    assert found == {(topic, other) for topic, others in TOPICS.items() for other in others}


def test_a_package_lists_only_what_others_use():
    """The names are those that another package, the public calls, or Blender's side take from it."""
    for package in ("algebra", "geometry", "operator"):
        listed = {name.rpartition(".")[2] for name in imported(ROOT / "core" / package / "__init__.py")}
        above = [path for other in BELOW for path in (ROOT / "core" / other).glob("*.py")]
        used = {name.rpartition(".")[2] for path in above for name in imported(path) if f"..{package}." in name}
        outside = {name.removeprefix(f".{package}.") for path in BLENDER_SIDE for name in taken(path)}
        assert listed == used | {name for name in core.__all__ if core._HOMES[name] == package} | (outside & listed)


@pytest.mark.parametrize("package", core._NAMESPACES)
def test_public_packages_name_what_they_export_as_type_checkers_ask_for_it(package):
    tree = ast.parse((ROOT / "core" / package / "__init__.py").read_text(encoding="utf-8"))
    names = [alias for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for alias in node.names]
    assert names
    assert [alias.name for alias in names if alias.asname != alias.name] == []


def test_core_needs_numpy_scipy_and_threadpoolctl_only():
    """But for files of LAS; that it imports theirs when it reads, is among the tests of these."""
    allowed = set(sys.stdlib_module_names) | {"numpy", "scipy", "threadpoolctl"}
    las = {("las_packages.py", name) for name in ("laspy", "lazrs")}
    wrong = [
        f"{file.name}: {name}"
        for file in sorted((ROOT / "core").rglob("*.py"))
        for name in imported(file)
        if not name.startswith(".") and name.split(".")[0] not in allowed and (file.name, name) not in las
    ]
    assert wrong == []


def test_few_numbers_between_points_and_matrix_are_chosen():
    """Each must have a case that it guards: docs/ablation.md."""
    assert sum(1 for _ in constants()) <= 45


def test_public_names_are_what_their_modules_hold():
    assert core.__all__ == sorted(set(core.__all__))
    assert set(core.__all__) <= set(dir(core))
    for name in core.__all__:
        assert getattr(core, name).__module__.startswith("core."), name
    assert len(core.__all__) < 30
    assert {*TOPICS, "files", "paper", "splats", "tiles", "__version__"} <= set(dir(core))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        core.nothing  # noqa: B018
    with pytest.raises(AttributeError, match=r"^`mf.geodesic_distance` is `mf.distance.geodesic_distance`$"):
        core.geodesic_distance  # noqa: B018


def test_the_page_of_namespaces_names_what_they_give():
    page = (ROOT / "docs" / "scripts.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `mf\.(\w+)` \|.*\| (.*) \|$", page, re.MULTILINE))
    assert rows.keys() == set(core._NAMESPACES)
    for space, names in rows.items():
        assert set(re.findall(r"`(\w+)`", names)) <= core._read(f"{space}/__init__.py").keys()


def test_a_name_is_given_by_one_namespace():
    given = [*core.__all__, *(name for space in core._NAMESPACES for name in core._read(f"{space}/__init__.py"))]
    assert {name for name in given if given.count(name) > 1} == {"build_laplacian"}  # the paper's own


TOGETHER = """
import threading, core
found, start = [], threading.Barrier(8)
def take(name):
    start.wait()
    found.append(getattr(core, name))
names = ["spectral", "splats", "tiles", "surface", "build_laplacian", "measure", "deform", "paper"]
threads = [threading.Thread(target=take, args=[name]) for name in names]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
assert len(found) == len(names)
"""


def test_threads_may_be_the_first_to_take_something():
    subprocess.run([sys.executable, "-c", TOGETHER], cwd=ROOT, check=True)


BROKEN = """
import sys
class Broken:
    def find_spec(self, name, path=None, target=None):
        if name == "scipy.spatial":
            raise ImportError("undefined symbol", name=sys.argv[1])
sys.meta_path.insert(0, Broken())
import core
core.LaplacianOptions()
try:
    core.build_laplacian
except core.PointCloudError as error:
    print(error)
"""


@pytest.mark.parametrize("name", ["scipy.spatial", "numpy.exceptions"])  # which newer ones ask of numpy 1.24
def test_a_scipy_that_does_not_load_is_told_where_it_is_needed(name):
    done = subprocess.run([sys.executable, "-c", BROKEN, name], cwd=ROOT, check=True, capture_output=True, text=True)
    assert "scipy of this Python does not serve: undefined symbol. Install one that fits." in done.stdout


def test_core_is_usable_from_the_repository_root_without_blender():
    names = ", ".join(PUBLIC)
    code = f"import sys; from core import {names}; assert 'bpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_core_never_uses_the_warnings_module():
    assert [file.name for file in (ROOT / "core").rglob("*.py") if "warnings" in imported(file)] == []


def test_the_version_is_that_of_the_extension():
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    assert core.__version__ == manifest["version"]
