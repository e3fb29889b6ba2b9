"""Errors and notices are templates with values: they can be translated, copied, and hold any names."""

import ast
import copy
import pickle
import string
from pathlib import Path

import numpy as np
import pytest

import core
from core import errors
from core.files import read_points
from core.phrases import Phrase

ROOT = Path(__file__).parents[2]
FAMILY = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, errors.PointCloudError)]
MADE = {"Phrase", *(kind.__name__ for kind in FAMILY)}
SAID = {"report": 1, "poll_message_set": 0}  # what shows a text, and the place of the text among what it takes
SOURCES = sorted(path for folder in ("core", "operators", "ui") for path in (ROOT / folder).rglob("*.py"))
PASSED_ON = {ROOT / "core" / name for name in ("errors.py", "phrases.py")}  # they make what is checked here
ENGLISH = {ROOT / "operators" / name for name in ("command.py", "deform_nodes.py")}  # a command line, and node sockets


def tree(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def called(node):
    return getattr(node.func, "attr", getattr(node.func, "id", ""))


def calls(path):
    return [node for node in ast.walk(tree(path)) if isinstance(node, ast.Call)]


def shows(call):
    """Whether a call shows a text to people; a mere `report()` is one of progress."""
    return called(call) in SAID and isinstance(call.func, ast.Attribute)


def phrases(path):
    """All calls in a file that make an error or a phrase."""
    return [] if path in PASSED_ON else [call for call in calls(path) if called(call) in MADE]


def literals(node):
    """Texts among which an expression chooses by its own, or None if a text is put together from other things."""
    if isinstance(node, ast.Constant):
        return [node.value] if isinstance(node.value, str) else None
    chosen = []
    if isinstance(node, ast.IfExp):
        chosen = [literals(node.body), literals(node.orelse)]
    elif isinstance(node, ast.Subscript) and isinstance(node.value, ast.Dict):
        chosen = [literals(value) for value in node.value.values]
    return [text for texts in chosen for text in texts] if chosen and None not in chosen else None


def fields(template):
    return {name for _, name, _, _ in string.Formatter().parse(template) if name is not None}


def problems(path):
    """What keeps phrases in a file from being translated."""
    for call in phrases(path):
        templates = literals(call.args[0]) if len(call.args) == 1 else None
        names = {keyword.arg for keyword in call.keywords}
        if templates is None or None in names:
            yield call.lineno, "the template is no literal"
            continue
        known = [fields(template) for template in templates]
        if any(needed - names for needed in known) or names - set.union(*known):
            yield call.lineno, f"the fields of {templates} are not {sorted(names)}"
        for keyword in call.keywords:
            if any(words(text) for text in strings(keyword.value)):
                yield call.lineno, f"{keyword.arg} has words that are no phrase"


def words(text):
    return [word for word in text.split() if sum(map(str.isalpha, word)) > 1]


def strings(node):
    """Texts that an expression may be, or is put together from, outside of calls."""
    if isinstance(node, ast.Constant):
        return [node.value] if isinstance(node.value, str) else []
    if isinstance(node, ast.Call | ast.Compare | ast.Subscript):
        return []
    return [text for child in ast.iter_child_nodes(node) for text in strings(child)]


def unsaid(path):
    """Texts that are shown without being looked up."""
    for call in calls(path):
        text = call.args[SAID[called(call)]] if shows(call) else None
        if text is not None and not (isinstance(text, ast.Call) and called(text) == "translated"):
            yield call.lineno, f"{called(call)} of what is not translated"


def loose(path):
    """Sentences within functions that are part of no phrase."""
    top = tree(path)
    kept = {id(part) for node in ast.walk(top) if takes_text(node) for part in ast.walk(node)}
    functions = [node for node in ast.walk(top) if isinstance(node, ast.FunctionDef)]
    parts = {id(part): part for function in functions for part in ast.walk(function) if id(part) not in kept}
    for part in parts.values():
        text = part.value if isinstance(part, ast.Constant) and isinstance(part.value, str) else ""
        if len(words(text)) > 2 and "\n" not in text:
            yield part.lineno, f"{text!r} is part of no phrase"


def takes_text(node):
    """Whether a text in there is a docstring, a phrase, looked up, of a property, or about an error of ours."""
    if isinstance(node, ast.Call):
        return called(node) in MADE | {"iface_", "RuntimeError"} or called(node).endswith("Property")
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def found(check, paths):
    return [f"{path.name}:{line}: {problem}" for path in paths for line, problem in check(path)]


def test_all_errors_and_notices_are_of_literal_templates():
    assert sum(len(phrases(path)) for path in SOURCES) > 200
    assert found(problems, SOURCES) == []


def test_all_that_is_reported_is_translated():
    assert sum(shows(call) for path in SOURCES for call in calls(path)) > 20
    assert found(unsaid, SOURCES) == []


def test_no_sentence_is_told_another_way():
    assert found(loose, [path for path in SOURCES if path not in ENGLISH and path.parent.name != "ui"]) == []


@pytest.mark.parametrize(
    ("check", "line"),
    [
        (problems, 'raise PointCloudError(f"{n} points")'),
        (problems, 'raise IslandError("There are " + str(n) + " points")'),
        (problems, 'raise AreaError("{} points".format(n))'),
        (problems, 'raise PointCloudError("There are {n} points", m=n)'),
        (problems, 'raise PointCloudError("There are points", n=n)'),
        (problems, "raise PointCloudError(reason)"),
        (problems, 'notices.append(Phrase(f"{n} points", n=n))'),
        (problems, 'Phrase("The {kind} is empty", kind="vertex group" if mesh else "attribute")'),
        (problems, 'Phrase("The {kind} is empty", kind=f"{n} groups")'),
        (unsaid, 'self.report({"INFO"}, f"{n} points")'),
        (unsaid, 'self.report({"ERROR"}, str(error))'),
        (unsaid, "cls.poll_message_set(reason)"),
        (loose, 'def f(): notices.append(f"There are {n} points too many")'),
        (loose, 'def f(): return "Settings changed. Bind again"'),
    ],
)
def test_the_checks_find(check, line, tmp_path):
    path = tmp_path / "new.py"
    path.write_text(line, encoding="utf-8")
    assert len(list(check(path))) == 1


def make(kind):
    more = {"resolved": 3} if kind is errors.UnresolvedModesError else {}
    error = kind('"{name}" has {count:,} points', name="{0} {x} {", count=np.int64(4000), **more)
    error.add_note("seen")
    return error


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda error: pickle.loads(pickle.dumps(error))])
@pytest.mark.parametrize("kind", FAMILY)
def test_errors_can_be_copied(kind, again):
    error = again(make(kind))
    assert type(error) is kind
    assert str(error) == '"{0} {x} {" has 4,000 points'
    assert error.template == '"{name}" has {count:,} points'
    assert error.values == make(kind).values
    assert error.__notes__ == ["seen"]
    if kind is errors.UnresolvedModesError:
        assert error.resolved == 3


@pytest.mark.parametrize(
    "again",
    [copy.copy, copy.deepcopy, *(lambda text, n=n: pickle.loads(pickle.dumps(text, n)) for n in range(6))],
)
def test_phrases_can_be_copied(again):
    inner = Phrase("line {number} has {word!r}", number=3, word="{x}")
    text = again(Phrase("{file}: {problem}.", file="{a}.ply", problem=inner))
    assert isinstance(text, str)
    assert text == "{a}.ply: line 3 has '{x}'."
    assert (text.template, text.values) == ("{file}: {problem}.", {"file": "{a}.ply", "problem": inner})
    assert text.values["problem"].template == "line {number} has {word!r}"


@pytest.mark.parametrize("kind", [core.PointCloudError, Phrase])
def test_values_must_fit(kind):
    with pytest.raises(KeyError, match="count"):
        kind("{count} points", number=3)


def test_resolved_is_asked_for():
    with pytest.raises(TypeError, match="resolved"):
        errors.UnresolvedModesError("{count} modes", count=3)


def test_an_error_of_the_mathematics_keeps_its_numbers():
    points = np.zeros((100, 3))
    points[3:5] = np.nan
    with pytest.raises(core.InvalidPointsError) as raised:
        core.build_laplacian(points)
    assert raised.value.values == {"bad": 2, "count": 100}
    assert raised.value.template.startswith("{bad} of {count} points have coordinates that are not finite")
    assert str(raised.value).startswith("2 of 100 points have coordinates that are not finite")


def test_a_file_name_may_hold_braces(tmp_path):
    with pytest.raises(core.PointCloudError, match=r"There is no file .*\{count\} \{\.ply"):
        read_points(tmp_path / "{count} {.ply")
