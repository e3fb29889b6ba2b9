"""The examples in the docstrings of the public calls, run as they stand, and the sections around them."""

import doctest
import inspect
import re

import pytest

import core
from tests.public import PUBLIC, SPACES

WITHOUT = {  # functions whose examples are those of what they go with, or which need a file
    *("check_points", "clean.band", "clean.boost", "clean.chebyshev_filter", "clean.exponential", "clean.fairing"),
    *("clean.smoothing_base", "deform.coarse_deformer", "load", "points_that_fit", "spectral.modes_needed"),
    *("spectral.signature_energies", "spectral.signature_times", "splats.floaters", "splats.read_splats"),
    *("splats.write_splats", "surface.values_on_mesh"),
}
CLASSES = {
    *("Agreed", "Doubt", "LaplacianOptions", "clean.Prolongation", "clean.Strays", "deform.CoarseDeformer"),
    *("deform.Deformer", "measure.Slopes"),
    *("motion.Heat", "motion.ReactionDiffusion", "motion.Wave", "rig.Skinner"),
}
METHODS = {f"LaplaceBeltrami.{name}" for name in ("apply", "eigenpairs", "release", "toward")}
FUNCTIONS = {name for name, one in PUBLIC.items() if inspect.isfunction(one)}
SHOWN = sorted(CLASSES | METHODS | FUNCTIONS - WITHOUT)
SECTIONS = ["Parameters", "Attributes", "Returns", "Raises", "See Also", "Notes", "References", "Examples"]
FOUND = {
    test.name: test
    for name, one in PUBLIC.items()
    for test in doctest.DocTestFinder(exclude_empty=False).find(one, name, globs={})
}
RUNNABLE = [name for name, test in FOUND.items() if test.examples]


def sections(name):
    """Names of the sections of a docstring, with their texts."""
    pieces = re.split(r"^([A-Z][A-Za-z ]+)\n-{3,}\n", inspect.cleandoc(FOUND[name].docstring), flags=re.MULTILINE)
    return dict(zip(pieces[1::2], pieces[2::2], strict=True))


@pytest.mark.parametrize("name", RUNNABLE)
def test_example_gives_what_it_says(name):
    printed = []
    doctest.DocTestRunner().run(FOUND[name], out=printed.append)
    assert not printed, "".join(printed)


def test_calls_that_users_start_from_have_examples():
    assert set(RUNNABLE) == set(SHOWN)


OTHERS = {  # of the namespaces that give more
    test.name: test
    for space in ("files", "paper", "splats", "tiles")
    for name in SPACES[space]
    if inspect.isfunction(one := getattr(getattr(core, space), name)) and f"{space}.{name}" not in PUBLIC
    for test in doctest.DocTestFinder().find(one, f"{space}.{name}", globs={})
    if test.examples
}


@pytest.mark.parametrize("name", OTHERS)
def test_example_of_a_package_gives_what_it_says(name):
    printed = []
    doctest.DocTestRunner().run(OTHERS[name], out=printed.append)
    assert not printed, "".join(printed)


def test_examples_call_core_by_the_name_that_it_has_in_the_wheel():
    import_of_it = "import meshfree_laplacian as mf\n"
    tests = OTHERS | {name: FOUND[name] for name in RUNNABLE}
    assert len(OTHERS) >= 5
    sources = {name: {example.source for example in test.examples} for name, test in tests.items()}
    assert [name for name, source in sources.items() if import_of_it not in source or "import core\n" in source] == []


def test_examples_begin_with_the_sphere_of_the_package():
    sphere = [example.source for example in doctest.DocTestParser().get_examples(core.__doc__)]
    begins = {name: [example.source for example in FOUND[name].examples[: len(sphere)]] for name in RUNNABLE}
    assert [name for name in RUNNABLE if begins[name] != sphere] == ["deform.minimal_surface"]


@pytest.mark.parametrize("name", SHOWN)
def test_see_also_names_what_there_is(name):
    lines = sections(name)["See Also"].strip().splitlines()
    named = [other.strip() for line in lines for other in line.split(" : ")[0].split(",")]
    assert named
    space = name.partition(".")[0]
    named = {other if other in FOUND or space not in SPACES else f"{space}.{other}" for other in named}
    assert named <= FOUND.keys()
    assert name not in named


@pytest.mark.parametrize("name", FOUND)
def test_sections_follow_the_order_of_numpydoc(name):
    found = list(sections(name))
    assert found == sorted(found, key=SECTIONS.index)
