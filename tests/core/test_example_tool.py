"""The example tool of CONTRIBUTING.md works as a subcommand."""

import json

import numpy as np
from numpy.testing import assert_allclose

import core
from command import line, tool_verb
from tests.example_tool import example_tool
from tools import quantities


def test_the_example_is_a_subcommand(tmp_path, capsys, monkeypatch):
    points = core.example_sphere() * [1.0, 0.8, 0.6] + [5.0, 0.0, 0.0]
    np.save(tmp_path / "a.npy", points)
    verb = tool_verb.ToolVerb(example_tool(quantities, monkeypatch))
    given = ["remoteness", str(tmp_path / "a.npy"), "--power", "2", "--out", str(tmp_path / "b.npz")]
    assert line.run(given, [verb], "meshfree") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["done"].startswith("a: up to ")
    found = np.load(tmp_path / "b.npz")["remoteness"]
    assert_allclose(found, np.sum((points - [5.0, 0.0, 0.0]) ** 2, axis=1), atol=1e-2)
