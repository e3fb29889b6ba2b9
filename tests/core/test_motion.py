"""Heat, waves and reactions against solutions by hand, and what they must keep."""

import functools

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import core
from benchmarks.samplings import open_cylinder, random_sphere, strip_points, torus_eigenvalues
from core.motion import propagation

RNG = np.random.default_rng(5)


@functools.cache
def sphere(count=800):
    return core.build_laplacian(core.example_sphere(count))


@functools.cache
def modes():
    return sphere().eigenpairs(9, raw=True, tolerance=1e-12)


@functools.cache
def patchy():
    """Two components, of which one has a boundary, and points in the air."""
    ball = random_sphere(600)
    x, y = np.mgrid[0:1:20j, 0:1:20j].reshape(2, -1)
    points = np.concatenate([ball, np.column_stack([x + 3.0, y, 0.0 * x]), [[0.0, 9.0, 0.0], [5.0, 5.0, 5.0]]])
    laplacian = core.build_laplacian(points, left_out=[1000, 1001])
    assert laplacian.component.max() == 1
    return laplacian


def spacing(laplacian):
    return np.sqrt(laplacian.areas[laplacian.component >= 0].mean())


STEPS = [0.1, 1.0, 30.0, 1e3, 1e4, 1e20]  # in units of the squared spacing: polynomials first, then equations


@pytest.mark.parametrize("step", STEPS)
def test_heat_keeps_its_total_on_each_component_and_its_range(step):
    laplacian = patchy()
    before = RNG.random((1002, 2)) - 0.3
    given = before.copy()
    after = core.motion.Heat(laplacian, step * spacing(laplacian) ** 2).advance(before)
    np.testing.assert_array_equal(before, given)
    for number in (0, 1):
        own = laplacian.component == number
        np.testing.assert_allclose(laplacian.areas[own] @ after[own], laplacian.areas[own] @ before[own], rtol=1e-12)
        assert (after[own].max(axis=0) < before[own].max(axis=0)).all()
        assert (after[own].min(axis=0) > before[own].min(axis=0)).all()
    np.testing.assert_array_equal(after[1000:], before[1000:])


def test_heat_keeps_its_total_over_a_thousand_steps():
    laplacian = sphere(300)
    heat, values = core.motion.Heat(laplacian, 0.3 * spacing(laplacian) ** 2), RNG.random(300)
    total = laplacian.areas @ values
    for _ in range(1000):
        values = heat.advance(values)
    assert laplacian.areas @ values == pytest.approx(total, rel=1e-10)
    assert np.ptp(values) < 0.1


@pytest.mark.parametrize("step", [1e-3, 0.1, 3.0])
def test_modes_of_heat_fade_as_their_exponentials(step):
    after = core.motion.Heat(sphere(), step).advance(modes().eigenvectors)
    expected = np.exp(-step * modes().eigenvalues) * modes().eigenvectors
    np.testing.assert_allclose(after, expected, atol=1e-10 * np.abs(expected).max())


def test_a_long_implicit_step_of_heat_is_near_the_exponential(monkeypatch):
    exact = core.motion.Heat(sphere(), 0.3).advance(modes().eigenvectors)
    monkeypatch.setattr(propagation, "_HEAT", 0.0)
    after = core.motion.Heat(sphere(), 0.3).advance(modes().eigenvectors)
    rational = (1.0 + 0.3 / 8 * modes().eigenvalues) ** -8.0
    np.testing.assert_allclose(after, rational * modes().eigenvectors, atol=1e-9)
    np.testing.assert_allclose(after, exact, atol=0.035 * np.abs(modes().eigenvectors).max())


@pytest.mark.parametrize("spread", [0.5, 2.0, 6.0])  # in spacings
def test_heat_of_spots_is_found_around_them(spread):
    """As everywhere to the accuracy, and left as it is where none arrives."""
    laplacian = sphere(4000)
    step = 0.25 * (spread * spacing(laplacian)) ** 2
    spots = np.linalg.norm(laplacian.points[:, None] - laplacian.points[[0, 1700]], axis=2) < 0.1
    before = 3.0 + 5.0 * spots
    exact = core.motion.Heat(laplacian, step).advance(before)
    after = core.motion.Heat(laplacian, step, accuracy=1e-6).advance(before)
    assert np.abs(after - exact).max() < 5e-6
    still = after == 3.0
    assert still.any(axis=0).all()
    assert np.abs(exact - 3.0)[still].max() < 5e-6
    assert (np.abs(exact - before).max(axis=0) > 0.1).all()


def test_heat_of_functions_that_vary_everywhere_is_found_everywhere():
    values = np.column_stack([RNG.random(800), np.ones(800), sphere().points[:, 0]])
    exact, after = (core.motion.Heat(sphere(), 0.02, accuracy=share).advance(values) for share in (0.0, 1e-3))
    np.testing.assert_array_equal(after[:, 1], 1.0)
    np.testing.assert_array_equal(after[:, [0, 2]], exact[:, [0, 2]])


def test_heat_of_spots_does_not_cross_to_other_components():
    laplacian = patchy()
    before = (laplacian.points[:, 2] > 0.9).astype(float)
    exact, after = (core.motion.Heat(laplacian, 0.02, accuracy=share).advance(before) for share in (0.0, 1e-6))
    assert np.abs(after - exact).max() < 1e-6
    np.testing.assert_array_equal(after[600:1000], 0.0)


def test_many_small_steps_of_heat_are_one_large_one():
    values = RNG.random(800)
    after, small = values, core.motion.Heat(sphere(), 0.01)
    for _ in range(20):
        after = small.advance(after)
    np.testing.assert_allclose(after, core.motion.Heat(sphere(), 0.2).advance(values), rtol=1e-11)


@pytest.mark.parametrize("step", STEPS)
def test_waves_keep_their_energy_and_momentum(step):
    laplacian = patchy()
    wave = core.motion.Wave(laplacian, min(step, 1e7) * spacing(laplacian), 1.3)
    known, component = laplacian.component >= 0, laplacian.component
    velocity = RNG.standard_normal(1002)
    means = np.bincount(component[known], laplacian.areas[known] * velocity[known])
    velocity[known] -= (means / np.bincount(component[known], laplacian.areas[known]))[component[known]]
    before = core.motion.WaveState(RNG.random(1002), velocity)
    after = wave.advance(before)
    energy = 0.5 * np.sum(laplacian.areas * velocity**2)
    energy += 0.5 * 1.3**2 * before.displacement @ (laplacian.stiffness @ before.displacement)
    assert wave.energy(before) == pytest.approx(energy, rel=1e-14)
    assert wave.energy(after) == pytest.approx(energy, rel=1e-9)
    for number in (0, 1):
        areas = np.where(component == number, laplacian.areas, 0.0)
        assert areas @ after.velocity == pytest.approx(0.0, abs=1e-10)
        assert areas @ after.displacement == pytest.approx(areas @ before.displacement, rel=1e-6)
    np.testing.assert_array_equal(np.array(after)[:, ~known], np.array(before)[:, ~known])


@pytest.mark.parametrize("step", [0.1, 1e4])
def test_a_push_moves_all_points_as_far(step):
    state = core.motion.Wave(sphere(), step).advance(np.stack([np.ones(800), np.full(800, 2.0)], axis=1))
    np.testing.assert_allclose(state, np.tile([1.0 + 2.0 * step, 2.0], (800, 1)), rtol=1e-9)


def test_waves_keep_their_energy_over_a_thousand_steps():
    wave = core.motion.Wave(sphere(300), spacing(sphere(300)))
    state = np.stack([RNG.random(300), RNG.random(300)], axis=1)
    energy = wave.energy(state)
    for _ in range(1000):
        state = wave.advance(state)
    assert wave.energy(state) == pytest.approx(energy, rel=1e-9)


def test_modes_of_waves_swing_with_the_root_of_their_eigenvalues():
    mode, step, speed = modes().eigenvectors[:, 5], 0.7, 2.5
    turn = speed * np.sqrt(modes().eigenvalues[5])
    after = core.motion.Wave(sphere(), step, speed).advance((mode, 3.0 * mode))
    factor = np.cos(turn * step) + 3.0 * np.sin(turn * step) / turn
    np.testing.assert_allclose(after.displacement, factor * mode, atol=1e-10)
    factor = 3.0 * np.cos(turn * step) - turn * np.sin(turn * step)
    np.testing.assert_allclose(after.velocity, factor * mode, atol=1e-9)


def test_a_long_implicit_step_of_a_wave_is_the_trapezoidal_rule(monkeypatch):
    monkeypatch.setattr(propagation, "_WAVE", 0.0)
    before = core.motion.WaveState(RNG.random(800), RNG.random(800))
    after = core.motion.Wave(sphere(), 0.2, 1.5).advance(before)
    u, v = (0.5 * (now + then) for now, then in zip(after, before, strict=True))
    np.testing.assert_allclose(after.displacement - before.displacement, 0.2 * v, atol=1e-12)
    change = 0.2 * 1.5**2 * sphere().apply(u, raw=True)
    np.testing.assert_allclose(after.velocity - before.velocity, change, atol=1e-9)


def test_a_plane_wave_runs_around_a_strip_at_its_speed():
    points = open_cylinder()
    laplacian = core.build_laplacian(points)
    angle, waves, speed, step = np.arctan2(points[:, 1], points[:, 0]), 5, 3.0, 0.05
    turn = speed * waves / 2.0
    wave = core.motion.Wave(laplacian, step, speed)
    state = core.motion.WaveState(np.cos(waves * angle), turn * np.sin(waves * angle))
    for _ in range(20):
        state = wave.advance(state)
    run = np.angle(laplacian.areas @ (state.displacement * np.exp(1j * waves * angle)))
    assert np.exp(1j * (run - turn * step * 20)) == pytest.approx(1.0, abs=0.01 * turn * step * 20)
    np.testing.assert_allclose(state.displacement, np.cos(waves * angle - run), atol=0.05)


@pytest.mark.parametrize("count", [None, 4000])
def test_a_standing_wave_swings_between_the_ends_of_a_strip_at_its_speed(count):
    points = strip_points(count)
    laplacian = core.build_laplacian(points)
    number = np.pi * 4 / 3.0
    profile = np.cos(number * points[:, 0])
    state = core.motion.WaveState(profile, np.zeros(len(points)))
    state = core.motion.Wave(laplacian, 0.25 * np.pi / number, 2.0).advance(state)  # an eighth of a turn, twice
    weights = laplacian.areas * profile
    place, velocity = weights @ state.displacement, weights @ state.velocity
    phase = np.arctan2(-velocity / (2.0 * number), place)
    assert phase == pytest.approx(0.5 * np.pi, rel=0.01)


def test_waves_on_a_torus_have_the_frequencies_of_its_modes(operators):
    laplacian = operators("fine torus")
    pairs = laplacian.eigenpairs(12)
    for mode, exact in zip(pairs.eigenvectors.T[1:], torus_eigenvalues(12)[1:], strict=True):
        step = 0.25 * np.pi / np.sqrt(exact)
        state = core.motion.Wave(laplacian, step).advance((mode, 0.0 * mode))
        weights = laplacian.areas * mode
        phase = np.arctan2(-(weights @ state.velocity) / np.sqrt(exact), weights @ state.displacement)
        assert phase == pytest.approx(0.25 * np.pi, rel=0.01)


MIXED = (0.04, 0.06, (2e-3, 1e-3))


def reaction_of(state, time, feed=0.04, kill=0.06):
    """The reaction alone, at one point."""

    def rate(_, y):
        eaten = y[0] * y[1] ** 2
        return [feed * (1.0 - y[0]) - eaten, eaten - (feed + kill) * y[1]]

    return solve_ivp(rate, (0.0, time), state, rtol=1e-10, atol=1e-12).y[:, -1]


@pytest.mark.parametrize(("step", "exact"), [(0.5, 1e-6), (5.0, 1e-3), (200.0, 2e-3)])
@pytest.mark.parametrize("state", [(1.0, 0.3), (0.5, 0.25), (0.0, 1.0), (3.0, 4.0)])
def test_where_all_points_are_alike_only_the_reaction_is_left(state, step, exact):
    reaction = core.motion.ReactionDiffusion(sphere(), step, *MIXED)
    after = reaction.advance([np.full(800, value) for value in state])
    assert np.ptp(after.food) < 1e-12
    np.testing.assert_allclose([after.food[0], after.eater[0]], reaction_of(state, step), atol=exact)


@pytest.mark.parametrize("step", [0.1, 1.0, 100.0, 1e4])
def test_concentrations_stay_between_zero_and_one_at_any_step(step):
    food, eater = RNG.random(800), np.zeros(800)
    eater[300:400] = 1.0 - food[300:400]
    state = core.motion.ReactionDiffusion(sphere(), step, *MIXED).advance((food, eater))
    assert min(state.food.min(), state.eater.min()) >= 0.0
    assert max(state.food.max(), state.eater.max()) <= 1.0


def test_without_feed_and_kill_the_sum_of_both_substances_stays():
    state = RNG.random((800, 2))
    reaction = core.motion.ReactionDiffusion(sphere(), 2.0, 0.0, 0.0, MIXED[2])
    after = reaction.advance(state)
    assert after.shape == (800, 2)
    areas = sphere().areas
    assert areas @ after.sum(axis=1) == pytest.approx(areas @ state.sum(axis=1), rel=1e-12)
    assert areas @ after[:, 0] < 0.9 * (areas @ state[:, 0])


def test_steps_of_reaction_and_diffusion_are_of_second_order():
    food = 1.0 - 0.5 * np.exp(-20.0 * (1.0 - sphere().points[:, 2]))

    def error(steps):
        reaction, state = core.motion.ReactionDiffusion(sphere(), 16.0 / steps, *MIXED), (food, 1.0 - food)
        for _ in range(steps):
            state = reaction.advance(state)
        return state.food

    exact = error(64)
    errors = [np.abs(error(steps) - exact).max() for steps in (4, 8)]
    assert 3.0 < errors[0] / errors[1] < 5.0


@pytest.mark.parametrize("damping", [0.0, 0.3, 1.4, 5.0])
def test_modes_of_waves_solve_their_equation(damping):
    pairs, areas = modes(), sphere().areas
    place, velocity = RNG.standard_normal(9), RNG.standard_normal(9)
    wave = core.motion.wave_modes(
        pairs, areas, pairs.eigenvectors @ place, pairs.eigenvectors @ velocity, speed=1.2, damping=damping
    )
    stiff = 1.2**2 * pairs.eigenvalues

    def rate(_, y):
        return np.concatenate([y[9:], -stiff * y[:9] - 2.0 * damping * y[9:]])

    times = np.array([0.0, 0.3, 1.0, 4.0])
    exact = solve_ivp(rate, (0.0, 4.0), np.concatenate([place, velocity]), t_eval=times, rtol=1e-10, atol=1e-12)
    found = wave(times) @ (areas[:, None] * pairs.eigenvectors)
    np.testing.assert_allclose(found, exact.y[:9].T, atol=1e-8)
    np.testing.assert_allclose(wave(1.0), wave(times)[2], atol=1e-14)
    assert wave(times.reshape(2, 2)).shape == (2, 2, 800)


def test_a_mode_that_is_critically_damped_fades_without_a_swing():
    frequency = float(np.sqrt(modes().eigenvalues[4]))
    mode, areas = modes().eigenvectors[:, 4], sphere().areas
    for damping in frequency * (1.0 + np.array([-1e-9, 0.0, 1e-9])):
        wave = core.motion.wave_modes(modes(), areas, mode, 0.0, damping=damping)
        expected = (1.0 + frequency * 1.5) * np.exp(-frequency * 1.5)
        assert areas @ (wave(1.5) * mode) == pytest.approx(expected, rel=1e-7)


def test_modes_of_waves_are_steps_of_waves():
    state = core.motion.WaveState(*(modes().eigenvectors @ RNG.standard_normal((9, 2))).T)
    at = core.motion.wave_modes(modes(), sphere().areas, *state, speed=0.8)
    wave = core.motion.Wave(sphere(), 0.4, 0.8)
    for number in range(1, 4):
        state = wave.advance(state)
        np.testing.assert_allclose(at(0.4 * number), state.displacement, atol=1e-9)


def test_a_push_moves_all_on_and_damping_stops_it():
    free = core.motion.wave_modes(modes(), sphere().areas, 0.0, 2.0)
    np.testing.assert_allclose(free(3.0), 6.0, rtol=1e-6)
    slowed = core.motion.wave_modes(modes(), sphere().areas, 0.0, 2.0, damping=0.25)
    np.testing.assert_allclose(slowed(1e3), 2.0 / (2.0 * 0.25), rtol=1e-6)


@pytest.mark.parametrize("unit", [1e-3, 1e6])
def test_motion_is_the_same_in_any_unit_place_and_order(unit):
    order = RNG.permutation(800)
    turn = np.linalg.qr(RNG.standard_normal((3, 3)))[0]
    moved = core.build_laplacian(unit * (sphere().points @ turn + [1.0, 2.0, 3.0])[order])
    values, velocity = RNG.random((2, 800))
    exact = {"rtol": 1e-6, "atol": 1e-6}  # as closely as the operators agree
    heat = core.motion.Heat(moved, unit**2 * 0.02).advance(values[order])
    np.testing.assert_allclose(heat, core.motion.Heat(sphere(), 0.02).advance(values)[order], **exact)
    wave = core.motion.Wave(moved, 0.1, unit).advance((values[order], velocity[order]))
    np.testing.assert_allclose(
        wave, np.array(core.motion.Wave(sphere(), 0.1).advance((values, velocity)))[:, order], **exact
    )
    rates = unit**2 * np.array(MIXED[2])
    mixed = core.motion.ReactionDiffusion(moved, 1.0, *MIXED[:2], rates).advance((values[order], velocity[order]))
    expected = core.motion.ReactionDiffusion(sphere(), 1.0, *MIXED).advance((values, velocity))
    np.testing.assert_allclose(mixed, np.array(expected)[:, order], **exact)


def test_progress_is_told_and_can_cancel():
    stages = []
    heat = core.motion.Heat(sphere(), 0.1, progress=lambda *told: stages.append(told))
    heat.advance(np.ones(800), progress=lambda *told: stages.append(told))
    assert {stage for stage, _ in stages} == {"Equations", "Step"}
    assert all(0.0 <= fraction <= 1.0 for _, fraction in stages)

    def cancel(stage, fraction):
        raise core.Cancelled

    for work in (
        lambda: core.motion.Wave(sphere(), 0.1, progress=cancel),
        lambda: heat.advance(np.ones(800), progress=cancel),
    ):
        with pytest.raises(core.Cancelled):
            work()


NOTHING = np.zeros(800)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda on: core.motion.Heat(on, 0.0), "step is 0.0. Use a number above zero"),
        (lambda on: core.motion.Heat(on, np.nan), "step is nan"),
        (lambda on: core.motion.Heat(on, True), "step is True"),
        (lambda on: core.motion.Heat(on, 1.0, accuracy=-1.0), "accuracy is -1.0"),
        (
            lambda on: core.motion.Heat(on, 1.0).advance(np.zeros(3)),
            r"shape \(3,\).*one row of real numbers for each of 800",
        ),
        (lambda on: core.motion.Heat(on, 1.0).advance(NOTHING + np.inf), "800 of 800 values are not finite"),
        (lambda on: core.motion.Wave(on, -1.0), "step is -1.0"),
        (lambda on: core.motion.Wave(on, 1.0, 0.0), "speed is 0.0"),
        (lambda on: core.motion.Wave(on, 1.0).advance(NOTHING), "no pair: .*Give two functions of 800 numbers"),
        (lambda on: core.motion.Wave(on, 1.0).advance((NOTHING, NOTHING[:5])), r"shape \(5,\)"),
        (lambda on: core.motion.Wave(on, 1.0).advance(0.0), "no pair"),
        (lambda on: core.motion.ReactionDiffusion(on, 0.0, *MIXED), "step is 0.0"),
        (
            lambda on: core.motion.ReactionDiffusion(on, 1.0, -0.1, 0.0, (1.0, 1.0)),
            "feed is -0.1. Use a number that is not",
        ),
        (lambda on: core.motion.ReactionDiffusion(on, 1.0, 0.1, "x", (1.0, 1.0)), "kill is 'x'"),
        (lambda on: core.motion.ReactionDiffusion(on, 1.0, 0.1, 0.1, 1.0), "rates are 1.0. Give two"),
        (lambda on: core.motion.ReactionDiffusion(on, 1.0, 0.1, 0.1, (1.0, np.inf)), "rate is inf"),
        (
            lambda on: core.motion.ReactionDiffusion(on, 1.0, *MIXED).advance((NOTHING - 1.0, NOTHING)),
            "800 of 800 points have negative concentrations",
        ),
        (lambda on: core.motion.wave_modes(modes(), on.areas, NOTHING, NOTHING, speed=0.0), "speed is 0.0"),
        (lambda on: core.motion.wave_modes(modes(), on.areas, NOTHING, 0.0, damping=-1.0), "damping is -1.0"),
        (lambda on: core.motion.wave_modes(modes(), on.areas[:3], NOTHING, 0.0), r"shape \(3,\)"),
        (lambda on: core.motion.wave_modes(modes(), on.areas, NOTHING, 0.0)(np.nan), "times are not finite"),
    ],
)
def test_errors_say_what_is_wrong(call, text):
    with pytest.raises(core.PointCloudError, match=text):
        call(sphere())


@pytest.mark.parametrize("pattern", ["spots", "stripes"])
def test_patterns_have_the_size_that_was_asked_for(pattern):
    """The mean of the squared wavenumber, by Rayleigh's quotient, is near that of the pattern."""
    laplacian, size = sphere(), 1.4
    near = laplacian.points @ laplacian.points[400] > np.cos(0.4 * size)
    reaction = core.motion.ReactionDiffusion.of_pattern(laplacian, 5.0, pattern, size)
    state = core.motion.Mixture(1.0 - near, 1.0 * near)
    for _ in range(300):
        state = reaction.advance(state)
    ripple = state.eater - laplacian.areas @ state.eater / laplacian.areas.sum()
    square = ripple @ (laplacian.stiffness @ ripple) / (laplacian.areas @ ripple**2)
    assert 2.0 * np.pi / np.sqrt(square) == pytest.approx(size, rel=0.25)
    assert ripple.max() > 0.1


def test_an_unknown_pattern_is_refused():
    with pytest.raises(core.PointCloudError, match="pattern is 'dots'. Choose one of 'spots', 'stripes'"):
        core.motion.ReactionDiffusion.of_pattern(sphere(), 1.0, "dots", 1.0)
