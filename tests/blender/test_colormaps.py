"""Colour maps, their ranges, the numbers on axes and their units: what needs no object."""

from types import SimpleNamespace

import numpy as np
import pytest

CONTINUOUS = ("VIRIDIS", "MAGMA", "COOL_WARM", "CYCLIC")


def lightness(colors):
    """CIE L* of linear colours, 0 to 100."""
    luminance = np.array(colors)[:, :3] @ (0.2126, 0.7152, 0.0722)
    return np.where(luminance > 0.008856, 116.0 * np.cbrt(luminance) - 16.0, 903.3 * luminance)


def oklab(colors):
    """Coordinates in which equal distances look alike: B. Ottosson, 2020."""
    cones = np.cbrt(
        np.array(colors)[:, :3]
        @ np.array(
            [
                [0.4122214708, 0.5363325363, 0.0514459929],
                [0.2119034982, 0.6806995451, 0.1073969566],
                [0.0883024619, 0.2817188376, 0.6299787005],
            ]
        ).T
    )
    return (
        cones
        @ np.array(
            [
                [0.2104542553, 0.7936177850, -0.0040720468],
                [1.9779984951, -2.4285922050, 0.4505937099],
                [0.0259040371, 0.7827717662, -0.8086757660],
            ]
        ).T
    )


@pytest.mark.parametrize("name", ["VIRIDIS", "MAGMA"])
def test_sequential_maps_grow_lighter_in_even_steps(colormaps, name):
    steps = np.diff(lightness(colormaps.colors(name)))
    assert (steps > 0.0).all()
    assert steps.max() < 1.5 * steps.mean()
    assert steps.min() > 0.3 * steps.mean()


def test_diverging_map_is_lightest_and_gray_in_the_middle(colormaps):
    colors = colormaps.colors("COOL_WARM")
    light = lightness(colors)
    middle = len(colors) // 2
    assert (np.diff(light[: middle + 1]) > 0.0).all()
    assert (np.diff(light[middle:]) < 0.0).all()
    assert np.ptp(colors[middle][:3]) < 0.05
    assert abs(light[0] - light[-1]) < 5.0


def test_cyclic_map_closes_in_even_steps(colormaps):
    colors = colormaps.colors("CYCLIC")
    assert colors[0] == colors[-1]
    steps = np.linalg.norm(np.diff(oklab(colors), axis=0), axis=1)
    assert np.ptp(steps) < 0.1 * steps.mean()
    assert len(set(colors)) == len(colors) - 1


@pytest.mark.parametrize("name", [*CONTINUOUS, "TRUTH"])
def test_reverse_reverses(colormaps, name):
    colors = colormaps.colors(name)
    assert colormaps.colors(name, reverse=True) == colors[::-1]
    assert all(0.0 <= value <= 1.0 for color in colors for value in color)


def test_reversed_categories_leave_none_gray(colormaps):
    gray, *colors = colormaps.colors("CATEGORICAL")
    assert len({gray, *colors}) == 8
    assert np.ptp(gray[:3]) == 0.0
    assert colormaps.colors("CATEGORICAL", reverse=True) == [gray, *colors[::-1]]


def test_screen_colors_are_those_of_the_palette(colormaps):
    red, green, blue, alpha = colormaps.to_display(colormaps.colors("VIRIDIS")[0])
    assert [round(255 * value) for value in (red, green, blue)] == [0x44, 0x01, 0x54]
    assert alpha == 1.0


@pytest.mark.parametrize("most", [4, 6, 8])
def test_ticks_are_round_and_inside(ticks, most):
    generator = np.random.default_rng(0)
    for _ in range(500):
        low = generator.normal() * 10.0 ** generator.uniform(-8, 8)
        high = low + 10.0 ** generator.uniform(-4, 4) * abs(low)
        found = np.array(ticks.round_ticks(low, high, most))
        slack = 1e-5 * (high - low)
        assert 1 < len(found) <= most or (len(found) == 1 and most == 4)
        assert low - slack <= found[0] <= found[-1] <= high + slack
        step = found[1] - found[0] if len(found) > 1 else found[0]
        mantissa = step / 10.0 ** np.floor(np.log10(abs(step)) + 1e-4)
        assert len(found) == 1 or min(abs(mantissa - factor) for factor in (1.0, 2.0, 5.0)) < 1e-2
        assert np.allclose(np.diff(found), step, rtol=1e-2)


@pytest.mark.parametrize(
    ("low", "high", "texts"),
    [
        (0.0, 1.0, ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]),
        (-20.9, 20.9, ["-20", "-10", "0", "10", "20"]),
        (0.0123, 0.0177, ["0.013", "0.014", "0.015", "0.016", "0.017"]),
        (0.0, 45000.0, ["0", "10,000", "20,000", "30,000", "40,000"]),
        (0.0, 5e-7, ["0", "1e-07", "2e-07", "3e-07", "4e-07", "5e-07"]),
    ],
)
def test_texts_of_ticks(ticks, low, high, texts):
    assert ticks.tick_texts(ticks.round_ticks(low, high, 6)) == texts


def test_texts_of_ticks_differ(ticks):
    generator = np.random.default_rng(1)
    for _ in range(500):
        low = generator.normal() * 10.0 ** generator.uniform(-9, 9)
        texts = ticks.tick_texts(ticks.round_ticks(low, low + 10.0 ** generator.uniform(-3, 3) * abs(low), 8))
        assert len(set(texts)) == len(texts)


def scene_units(system="METRIC", length_unit="ADAPTIVE", scale_length=1.0):
    return SimpleNamespace(system=system, length_unit=length_unit, scale_length=scale_length)


@pytest.mark.parametrize(
    ("name", "greatest", "settings", "symbol", "factor"),
    [
        ("lb_area", 2.5, {}, "m²", 1.0),
        ("lb_area", 2.5e-4, {}, "cm²", 1e4),
        ("lb_distance", 0.02, {}, "cm", 100.0),
        ("lb_distance", 0.02, {"length_unit": "METERS"}, "cm", 100.0),
        ("lb_distance", 0.02, {"length_unit": "KILOMETERS"}, "km", 0.001),
        ("lb_distance", 5000.0, {}, "km", 0.001),
        ("lb_distance", 1e-9, {}, "µm", 1e6),
        ("lb_area", 2.5, {"length_unit": "MILLIMETERS"}, "mm²", 1e6),
        ("lb_area", 2.0, {"scale_length": 0.1}, "cm²", 100.0),
        ("lb_mean_curvature", 200.0, {}, "1/m", 1.0),
        ("lb_gaussian_curvature", 3.0, {"length_unit": "CENTIMETERS"}, "1/cm²", 1e-4),
        ("lb_mean_curvature", 3.0, {"system": "IMPERIAL"}, "1/ft", 0.3048),
        ("lb_distance", 2.0, {"system": "NONE"}, "", 1.0),
        ("lb_eigenvector_002", 3.0, {}, "", 1.0),
        ("lb_segment", 3.0, {}, "", 1.0),
    ],
)
def test_units(units, name, greatest, settings, symbol, factor):
    found = units.unit(units.attribute_power(name), greatest, scene_units(**settings))
    assert found[0] == symbol
    assert found[1] == pytest.approx(factor)


def test_classes_of_lidar_have_a_color_each(colormaps):
    _, *colors = np.array([colormaps.to_display(color)[:3] for color in colormaps.colors("LIDAR")])
    apart = np.linalg.norm(np.array(colors)[:, None] - colors, axis=2) + np.eye(len(colors))
    assert (len(colors), apart.min() > 0.15) == (31, True)
