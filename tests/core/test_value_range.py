"""The colour map and the range that suit values, and their histogram."""

import numpy as np
import pytest

from ui.value_range import all_zero, fit_range, histogram

CONTINUOUS = ("VIRIDIS", "MAGMA", "COOL_WARM", "CYCLIC")
VALUES = np.append(np.linspace(-1.0, 3.0, 401), 1000.0)


@pytest.mark.parametrize(
    ("mode", "low", "high"),
    [
        ("DATA", -1.0, 1000.0),
        ("PERCENTILE", *np.percentile(VALUES, (5.0, 95.0))),
        ("SYMMETRIC", -np.percentile(VALUES, 95.0), np.percentile(VALUES, 95.0)),
        ("LOCKED", -7.0, 11.0),
    ],
)
@pytest.mark.parametrize("name", CONTINUOUS)
def test_ranges_do_as_they_are_named(name, mode, low, high):
    fitted = fit_range(VALUES, name, mode, coverage=90.0, locked=(-7.0, 11.0))
    assert fitted[0] == name
    assert fitted[1:] == pytest.approx((low, high))


@pytest.mark.parametrize(
    ("name", "mode"),
    [("VIRIDIS", "PERCENTILE"), ("MAGMA", "PERCENTILE"), ("COOL_WARM", "SYMMETRIC"), ("CYCLIC", "DATA")],
)
def test_automatic_range_suits_the_map(name, mode):
    assert fit_range(VALUES, name, "AUTO") == fit_range(VALUES, name, mode)


def test_automatic_range_of_one_sign_is_not_stretched_to_the_other():
    assert fit_range(np.linspace(2.0, 3.0, 101), "COOL_WARM", "AUTO", 100.0)[1:] == (2.0, 3.0)


def test_locked_range_is_put_in_order():
    assert fit_range(VALUES, "VIRIDIS", "LOCKED", locked=(2.0, -1.0))[1:] == (-1.0, 2.0)


def test_categories_span_whole_numbers():
    assert fit_range(np.arange(-1, 30), "CATEGORICAL") == ("CATEGORICAL", -1.0, 29.0)
    assert fit_range(np.linspace(0.2, 2.8, 50), "CATEGORICAL", "DATA") == ("CATEGORICAL", 0.0, 3.0)


def test_outliers_do_not_wash_the_colors_out():
    values = np.linspace(1.0, 2.0, 1000)
    values[:3] = 1e6
    name, low, high = fit_range(values, coverage=98.0)
    assert name == "VIRIDIS"
    assert 1.0 <= low < high < 2.1


@pytest.mark.parametrize(
    ("values", "name"),
    [
        (np.zeros(5, bool), "TRUTH"),
        (np.zeros(5, np.int32), "CATEGORICAL"),
        (np.arange(-1, 7), "CATEGORICAL"),
        (np.arange(-1, 8), "VIRIDIS"),
        (np.arange(-2, 3), "COOL_WARM"),
        (np.arange(3.0), "VIRIDIS"),
    ],
    ids=["truth", "one part", "parts", "many parts", "signed", "numbers"],
)
def test_automatic_maps(values, name):
    assert fit_range(values, coverage=98.0)[0] == name
    assert fit_range(values, coverage=98.0, name="VIRIDIS")[0] == "VIRIDIS"


@pytest.mark.parametrize(
    ("values", "low", "high"),
    [
        (np.full(9, 3.0), 2.7, 3.3),
        (np.zeros(9), -1.0, 1.0),
        (np.array([np.nan, 1.0, 2.0]), 1.0, 2.0),
        (np.full(3, np.nan), 0.0, 1.0),
        (np.arange(100) == 7, 0.0, 1.0),
        (np.empty(0), 0.0, 1.0),
    ],
    ids=["constant", "zero", "not finite in part", "not finite", "one of many", "empty"],
)
def test_range_of_special_values(values, low, high):
    coverage = 100.0 if np.isnan(values.astype(float)).any() else 98.0
    assert fit_range(values, coverage=coverage)[1:] == pytest.approx((low, high))


@pytest.mark.parametrize("kind", [np.int32, np.float64])
def test_a_few_glints_do_not_dominate_intensities(kind):
    values = np.append(np.linspace(10, 500, 2495), np.full(5, 60_000)).astype(kind)
    low, high = fit_range(values, coverage=98.0)[1:]
    assert 10 <= low < 20
    assert 490 < high <= 500
    assert fit_range(values, mode="PERCENTILE", coverage=100.0)[1:] == (10.0, 60_000.0)
    assert fit_range(values, mode="DATA", coverage=98.0)[1:] == (10.0, 60_000.0)


def test_ranges_of_distances_begin_at_zero():
    values = np.append(np.linspace(0.5, 8.0, 99), 100.0)
    assert fit_range(values, coverage=98.0, from_zero=True)[1:] == (0.0, fit_range(values, coverage=98.0)[2])
    assert fit_range(values, mode="DATA", from_zero=True)[1] == 0.5  # by choice
    assert fit_range(-values, coverage=98.0, from_zero=True)[1:] == fit_range(-values, coverage=98.0)[1:]


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        (np.zeros(5), True),
        (np.array([0.0, 1e-30]), False),
        (np.empty(0), False),
        (np.zeros(5, np.int32), False),
        (np.zeros(5, bool), False),
        (np.array([0.0, np.nan]), False),
    ],
)
def test_nothing_but_zeros_is_no_range(values, expected):
    assert all_zero(values) == expected


def test_histogram_counts_every_value_near_the_range():
    values = np.append(np.random.default_rng(0).normal(size=5000), (np.nan, 50.0))
    edges, counts, beyond = histogram(values, (-1.0, 1.0), stepped=False)
    assert beyond == (np.count_nonzero(values < -1.0), np.count_nonzero(values > 1.0))
    assert (edges[0], edges[-1]) == (-2.0, 2.0)
    assert counts.sum() == np.count_nonzero(np.abs(values) <= 2.0)
    edges, counts, beyond = histogram(np.array([0.2, 0.4]), (0.0, 1.0), stepped=False)
    assert (edges[0], edges[-1], counts.sum(), beyond) == (0.0, 1.0, 2, (0, 0))
    edges, counts, beyond = histogram(np.array([-1, 0, 0, 2]), (-1.0, 2.0), stepped=True)
    assert counts.tolist() == [1, 2, 0, 1]
    edges, counts, beyond = histogram(np.empty(0), (0.0, 1.0), stepped=False)
    assert counts.sum() == 0
