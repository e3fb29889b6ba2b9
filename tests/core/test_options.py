import dataclasses

import numpy as np
import pytest

import core

OPTIONS = [
    (kind, field.name) for kind in (core.LaplacianOptions, core.PaperOptions) for field in dataclasses.fields(kind)
]
NONE_OF_THEM = [None, np.array([1, 2]), [1], "x", -1, np.nan, np.inf, {}, 1j]


@pytest.mark.parametrize("value", NONE_OF_THEM, ids=repr)
@pytest.mark.parametrize(("kind", "name"), OPTIONS)
def test_what_no_option_can_be_is_told(kind, name, value):
    with pytest.raises(core.PointCloudError, match=f"Option {name} is"):
        kind(**{name: value})


def test_numbers_and_truth_values_of_numpy_are_some():
    options = core.LaplacianOptions(neighbors=np.int64(50), bandwidth_factor=np.float32(1.0), sheets=np.bool_(False))
    assert options == core.LaplacianOptions(neighbors=50, sheets=False)


@pytest.mark.parametrize("options", [None, {}, "paper"])
@pytest.mark.parametrize("call", [core.build_laplacian, core.estimate_areas, core.estimate_normals])
def test_options_of_another_type(call, options):
    with pytest.raises(core.PointCloudError, match="Use LaplacianOptions"):
        call(np.eye(3), options=options)
