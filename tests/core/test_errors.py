"""Errors can be copied and sent to other processes, and hold any names."""

import copy
import pickle

import pytest

import core
from core import errors
from core.files import read_points

FAMILY = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, core.PointCloudError)]


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda error: pickle.loads(pickle.dumps(error))])
@pytest.mark.parametrize("kind", FAMILY)
def test_errors_can_be_copied(kind, again):
    more = {core.UnresolvedModesError: {"resolved": 3}, core.NotEnoughMemoryError: {"fitting": 3}}.get(kind, {})
    given = kind('"{0} {x} {" has 4,000 points', **more)
    given.add_note("seen")
    error = again(given)
    assert type(error) is kind
    assert str(error) == '"{0} {x} {" has 4,000 points'
    assert error.__notes__ == ["seen"]
    for name, number in more.items():
        assert getattr(error, name) == number


def test_a_file_name_may_hold_braces(tmp_path):
    with pytest.raises(core.PointCloudError, match=r"There is no file .*\{count\} \{\.ply"):
        read_points(tmp_path / "{count} {.ply")
