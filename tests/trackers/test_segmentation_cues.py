"""Cues of planes, colours and contours: their dynamics by moments, their weights by definition."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trackers.contours.cells import colour_cells
from trackers.contours.chain import Hypotheses
from trackers.contours.colour_cue import ColourCue, ColourDynamics, Palettes
from trackers.contours.contour_cue import ContourCue, ContourDynamics, KalmanContourCue
from trackers.contours.discriminant import basis_of, plane_normal
from trackers.contours.mixture import (
    Mixture,
    components_of,
    fitted,
    mixture_of,
    refined_on_planes,
)
from trackers.contours.observation import (
    drawn,
    graded,
    observe,
    window_around,
    with_colour_sets,
)
from trackers.contours.plane_cue import GivenPlane, PlaneCue, projected_colours
from trackers.contours.posterior import posterior
from trackers.contours.refitting import Fit, RefittedColours, blended

BASIS = np.linalg.qr(np.array([[1.0, 0.2], [0.1, 1.0], [-0.5, 0.3]]))[0]
SQUARE = np.array([[20.0, 10.0], [50.0, 10.0], [50.0, 40.0], [20.0, 40.0]])
STILL = ContourDynamics(np.zeros((2, 2)), np.zeros(2))


@pytest.fixture(scope="module")
def image():
    random = np.random.default_rng(4)
    picture = random.integers(0, 120, (60, 80, 3))
    picture[10:40, 20:50] = random.integers(100, 255, (30, 30, 3))
    return picture.astype(np.uint8)


@pytest.fixture
def observation(image):
    cells = colour_cells(image, 8)
    seen = observe(cells, (16, 6, 54, 44), prior=0.5)
    return with_colour_sets(seen, image, (150, 250), (2, 3), np.random.default_rng(1))


def mixtures(seed=0, of_target=2, of_background=3):
    random = np.random.default_rng(seed)
    return components_of(
        Mixture(
            np.concatenate([np.full(of_target, 1 / of_target), np.full(of_background, 1 / 3)]),
            random.uniform(0, 1, (of_target + of_background, 2)),
            np.eye(2) * random.uniform(0.01, 0.05, (of_target + of_background, 1, 1)),
        )
    )


def dynamics(**spreads):
    none = dict.fromkeys(
        ("mean", "shift", "gain", "jump_probability", "jump", "weight", "eigenvalue", "angle"), 0.0
    )
    return ColourDynamics(**{"kind": "shared", **none, **spreads})


# What the cues are shown.


@given(
    st.floats(-30, 100), st.floats(-30, 80), st.floats(0, 40), st.floats(0, 12), st.floats(0, 0.5)
)
def test_a_window_holds_the_contour_with_its_tolerance_as_far_as_the_image_goes(
    x, y, side, margin, growth
):
    contour = np.array([[x, y], [x + side, y], [x + side, y + side], [x, y + side]])
    x0, y0, x1, y1 = window_around(contour, margin, growth, 80, 60)
    assert 0 <= x0 < x1 <= 80
    assert 0 <= y0 < y1 <= 60
    assert min(x1 - x0, y1 - y0) >= 8
    more = margin + growth * side / 2
    for column in range(80):
        if x - more <= column and column + 1 <= x + side + more:
            assert x0 <= column < x1
    assert x1 - x0 <= max(8, side + 2 * more + 2)


def test_contrast_is_the_mean_in_the_window_minus_the_mean_outside(image):
    cells = colour_cells(image, 8)
    table = np.random.default_rng(2).random(len(cells.colours))
    values = table[cells.image]
    within = np.zeros((60, 80), bool)
    within[6:44, 16:54] = True
    contrast = observe(cells, (16, 6, 54, 44)).contrast
    assert table @ contrast == pytest.approx(values[within].mean() - values[~within].mean())
    around = np.zeros_like(within)
    around[0:60, 0:80] = True
    ringed = observe(cells, (30, 20, 50, 40), ring=2.0).contrast
    within[:] = False
    within[20:40, 30:50] = True
    around[:] = False
    around[10:50, 20:60] = True
    beside = around & ~within
    assert table @ ringed == pytest.approx(values[within].mean() - values[beside].mean())


def test_colours_outside_are_drawn_where_they_are_compared():
    picture = np.zeros((60, 80, 3), np.uint8)
    picture[10:50, 20:60] = 100  # the ring
    picture[20:40, 30:50] = 200  # the window
    cells = colour_cells(picture, 8)
    for ring, seen in ((2.0, [100]), (np.inf, [0, 100])):
        observed = observe(cells, (30, 20, 50, 40), ring=ring)
        sets = with_colour_sets(observed, picture, (50, 300), (1, 2), np.random.default_rng(0))
        assert np.unique(np.round(sets.outside.points * 255)).tolist() == seen
        assert np.unique(np.round(sets.inside.points * 255)).tolist() == [200]


def test_a_window_that_fills_the_image_has_nothing_to_be_compared_with(image):
    cells = colour_cells(image, 8)
    table = np.random.default_rng(2).random(len(cells.colours))
    contrast = observe(cells, (0, 0, 80, 60)).contrast
    assert table @ contrast == pytest.approx(table[cells.image].mean())


def test_colours_are_drawn_evenly_from_the_region_as_red_green_blue(image):
    region = np.zeros((60, 80), bool)
    region[10:12, 20:22] = True
    colours = drawn(image, region, 4000, np.random.default_rng(0))
    found, counts = np.unique(colours, axis=0, return_counts=True)
    expected = np.unique(image[region][:, ::-1] / 255, axis=0)
    np.testing.assert_allclose(found, expected)
    assert np.abs(counts - 1000).max() < 150


def test_differences_are_weights_as_they_are_or_as_exponentials():
    scores = np.array([-0.2, 0.0, 0.1, 0.3])
    np.testing.assert_array_equal(graded(scores, "literal", 9.0), [0, 0, 0.1, 0.3])
    assert graded(np.array([1e-40, -0.1, 9e-7]), "literal", 9.0).tolist() == [0, 0, 0]
    weights = graded(scores, "exponential", 0.05)
    np.testing.assert_allclose(np.diff(np.log(weights)), np.diff(scores) / 0.05)


# Planes.


def plane_cue(count=40_000, spread=0.05):
    return PlaneCue(BASIS, count, spread, "literal", 1.0, 0.05)


def test_normals_go_on_by_a_random_matrix_and_a_random_step():
    cue, random = plane_cue(), np.random.default_rng(0)
    start = np.repeat(plane_normal(BASIS)[np.newaxis], 40_000, axis=0)
    moved = cue.propagated(start, random)
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), 1.0)
    # Across the normal H n + p has variance s² |n|² + s², and its length is 1 to first order.
    across = moved @ BASIS
    np.testing.assert_allclose(across.std(axis=0), 0.05 * np.sqrt(2), rtol=0.03)
    np.testing.assert_allclose(across.mean(axis=0), 0.0, atol=0.002)


def test_normals_stay_on_the_first_ones_side():
    cue = plane_cue(2000, spread=2.0)
    moved = cue.propagated(cue.states, np.random.default_rng(0))
    assert (moved @ plane_normal(BASIS) >= 0).all()


def test_planes_are_weighed_by_the_posterior_of_the_window(observation):
    cue = plane_cue(3, spread=0.3)
    states = cue.sample(np.random.default_rng(5))
    weighed = cue.weigh(observation, states, None, ())
    bases = basis_of(states, BASIS)
    expected = []
    for basis in bases:
        colours = observation.cells.colours @ basis
        sides = [
            refined_on_planes(side.points, side.mixture, basis[np.newaxis], 2)
            for side in (observation.inside, observation.outside)
        ]
        inside, outside = (Mixture(*(part[0] for part in side)) for side in sides)
        expected.append(posterior(colours, inside, outside, 0.05, 0.5) @ observation.contrast)
    np.testing.assert_allclose(weighed.weights, np.maximum(expected, 0), atol=2e-5)
    np.testing.assert_allclose(
        weighed.evidence, [observation.cells.colours @ basis for basis in bases], atol=1e-12
    )


def test_planes_cannot_be_weighed_without_colours_drawn_from_the_window(image):
    cue = plane_cue(3)
    with pytest.raises(ValueError, match="sets of colours"):
        cue.weigh(observe(colour_cells(image, 8), (16, 6, 54, 44)), cue.states, None, ())


# Colours.


@pytest.mark.parametrize("kind", ["shared", "diagonal"])
def test_each_number_of_a_mixture_has_its_own_deviation(kind):
    states = np.repeat(mixtures()[np.newaxis], 20_000, axis=0)
    moved = dynamics(kind=kind, mean=0.02, weight=0.1, eigenvalue=0.08, angle=0.05).propagated(
        states, 2, np.random.default_rng(0)
    )
    np.testing.assert_allclose((moved - states)[:, :, 1:3].std(axis=0), 0.02, rtol=0.04)
    ratios = np.log(moved[:, :, 3:5] / states[:, :, 3:5])
    np.testing.assert_allclose(ratios.std(axis=0), 0.08, rtol=0.04)
    np.testing.assert_allclose((moved - states)[:, :, 5].std(axis=0), 0.05, rtol=0.04)
    # The logarithm of a ratio of two weights is not touched by their normalisation.
    odds = np.log(moved[:, 0, 0] / moved[:, 1, 0])
    assert odds.std() == pytest.approx(0.1 * np.sqrt(2), rel=0.04)


def test_the_shared_gain_scales_all_centroids_and_eigenvalues_alike():
    states = np.repeat(mixtures()[np.newaxis], 20_000, axis=0)
    moved = dynamics(gain=0.04).propagated(states, 2, np.random.default_rng(0))
    gains = np.log(moved[:, :, 3] / states[:, :, 3])
    np.testing.assert_allclose(gains, gains[:, :1] * np.ones(5), atol=1e-9)
    assert gains[:, 0].std() == pytest.approx(0.04, rel=0.03)
    maps = np.einsum("nmi,mj->nij", moved[:, :, 1:3], np.linalg.pinv(states[0, :, 1:3]).T)
    np.testing.assert_allclose(
        moved[:, :, 1:3], np.einsum("nij,nmj->nmi", maps, states[:, :, 1:3]), atol=1e-9
    )
    others = maps - np.exp(gains[:, 0])[:, np.newaxis, np.newaxis] * np.eye(2)
    np.testing.assert_allclose(others.std(axis=0), 0.02, rtol=0.03)


def test_the_shared_gain_jumps_as_often_and_as_far_as_asked():
    states = np.repeat(mixtures()[np.newaxis], 40_000, axis=0)
    moved = dynamics(jump_probability=0.25, jump=0.1).propagated(
        states, 2, np.random.default_rng(0)
    )
    gains = np.log(moved[:, 0, 3] / states[:, 0, 3])
    assert (gains != 0).mean() == pytest.approx(0.25, abs=0.01)
    assert gains[gains != 0].std() == pytest.approx(0.1, rel=0.03)


def test_a_class_shifts_as_a_whole():
    states = np.repeat(mixtures()[np.newaxis], 5000, axis=0)
    moved = dynamics(shift=0.03).propagated(states, 2, np.random.default_rng(0))
    shifts = (moved - states)[:, :, 1:3]
    for part in (shifts[:, :2], shifts[:, 2:]):
        np.testing.assert_allclose(part, part[:, :1] * np.ones((1, part.shape[1], 1)), atol=1e-12)
        np.testing.assert_allclose(part[:, 0].std(axis=0), 0.03, rtol=0.05)
    assert abs(np.corrcoef(shifts[:, 0, 0], shifts[:, 2, 0])[0, 1]) < 0.05


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_mixtures_stay_mixtures(seed):
    states = np.repeat(mixtures(seed)[np.newaxis], 20, axis=0)
    wild = dynamics(gain=2.0, weight=2.0, eigenvalue=3.0, jump_probability=0.5, jump=3.0)
    before = states.copy()
    moved = wild.propagated(states, 2, np.random.default_rng(seed))
    np.testing.assert_array_equal(states, before)
    assert (moved[:, :, 3:5] >= 2e-4).all()
    assert (moved[:, :, 3:5] <= 0.15).all()
    np.testing.assert_allclose(moved[:, :2, 0].sum(axis=1), 1.0)
    np.testing.assert_allclose(moved[:, 2:, 0].sum(axis=1), 1.0)


def planes_found(observation, normals):
    colours = projected_colours(observation, basis_of(normals, BASIS))
    return Hypotheses(normals, np.full(len(normals), 1 / len(normals)), None, colours)


def test_mixtures_are_weighed_on_the_plane_that_they_are_attached_to(observation):
    normals = plane_cue(4, 0.2).sample(np.random.default_rng(0))
    planes = planes_found(observation, normals)
    palettes = Palettes(2, "literal", 1.0, 0.05)
    cue = ColourCue(mixtures(), 6, dynamics(mean=0.1), palettes)
    states = cue.sample(np.random.default_rng(1))
    attached = np.array([3, 1, 1, 0, 2, 3])
    seen = observation._replace(prior=0.3)
    weighed = cue.weigh(seen, states, attached, [planes])
    for j, plane in enumerate(attached):
        expected = posterior(
            planes.evidence[plane], mixture_of(states[j, :2]), mixture_of(states[j, 2:]), 0.05, 0.3
        )
        np.testing.assert_allclose(weighed.evidence[j], expected, atol=3e-5)
        assert weighed.weights[j] == pytest.approx(
            max(expected @ observation.contrast, 0), abs=3e-5
        )


def test_mixtures_cannot_be_weighed_without_a_plane(observation):
    cue = ColourCue(mixtures(), 6, dynamics(), Palettes(2, "literal", 1.0, 0.05))
    with pytest.raises(ValueError, match="planes comes before"):
        cue.weigh(observation, cue.states, None, ())


def test_a_given_plane_is_the_only_hypothesis(observation):
    plane = GivenPlane(BASIS)
    plane.normal = plane_cue(1, 0.2).sample(np.random.default_rng(0))[0]
    states = plane.sample(np.random.default_rng(0))
    weighed = plane.weigh(observation, states, None, ())
    np.testing.assert_array_equal(states, [plane.normal])
    assert weighed.weights.tolist() == [1.0]
    basis = basis_of(states, BASIS)[0]
    np.testing.assert_allclose(weighed.evidence[0], observation.cells.colours @ basis, atol=1e-12)


# Contours.


def test_contours_deform_about_their_own_mean_and_shift():
    affine, shift = np.array([[0.04, 0.02], [0.03, 0.05]]), np.array([3.0, 1.5])
    cue = ContourCue(SQUARE, 20_000, ContourDynamics(affine, shift), "window", "literal", 1.0)
    moved = cue.propagated(cue.states, np.random.default_rng(0))
    centres = moved.mean(axis=1)
    np.testing.assert_allclose(centres.mean(axis=0), SQUARE.mean(axis=0), atol=0.1)
    np.testing.assert_allclose(centres.std(axis=0), shift, rtol=0.03)
    around = SQUARE - SQUARE.mean(axis=0)
    maps = np.einsum("npi,pj->nij", moved - centres[:, np.newaxis], np.linalg.pinv(around).T)
    np.testing.assert_allclose(maps.mean(axis=0), np.eye(2), atol=0.002)
    np.testing.assert_allclose(maps.std(axis=0), affine, rtol=0.03)


def test_anchors_take_the_places_of_the_first_particles():
    cue = ContourCue(SQUARE, 5, STILL, "window", "literal", 1.0)
    cue.anchors = np.repeat((SQUARE + 7)[np.newaxis], 2, axis=0)
    drawn_states = cue.sample(np.random.default_rng(0))
    np.testing.assert_allclose(drawn_states[:2], cue.anchors)
    np.testing.assert_allclose(drawn_states[2:], np.repeat(SQUARE[np.newaxis], 3, axis=0))


@pytest.mark.parametrize("outside", ["window", "image"])
def test_contours_are_weighed_by_the_map_that_they_are_attached_to(observation, outside):
    random = np.random.default_rng(0)
    tables = random.random((2, len(observation.cells.colours))).astype(np.float32)
    colours = Hypotheses(np.zeros((2, 1)), np.full(2, 0.5), np.zeros(2, int), tables)
    cue = ContourCue(SQUARE, 3, STILL, outside, "literal", 1.0)
    states = np.stack([SQUARE, SQUARE + 5, 0.2 * SQUARE])
    scores = cue.weigh(observation, states, np.array([1, 0, 1]), [colours]).evidence
    window = np.zeros((60, 80), bool)
    # The window and all contours lie in these rows and columns.
    window[min(2, 6) : 45, 4:55] = True
    region = window if outside == "window" else np.ones((60, 80), bool)
    for score, contour, which in zip(scores[:2], states, (1, 0), strict=False):
        (x0, y0), (x1, y1) = contour.min(axis=0).astype(int), contour.max(axis=0).astype(int)
        inside = np.zeros((60, 80), bool)
        inside[y0:y1, x0:x1] = True
        values = tables[which][observation.cells.image]
        expected = values[inside].mean() - values[region & ~inside].mean()
        assert score == pytest.approx(expected, abs=1e-6)
    assert scores[2] == -1  # fewer than 60 pixels


def test_contours_cannot_be_weighed_without_colours(observation):
    cue = ContourCue(SQUARE, 3, STILL, "window", "literal", 1.0)
    with pytest.raises(ValueError, match="colours comes before"):
        cue.weigh(observation, cue.states, None, ())


def test_the_kalman_filter_ends_with_the_weighted_contours_mean_and_variance():
    motion = ContourDynamics(np.zeros((2, 2)), np.array([3.0, 2.0]))
    cue = KalmanContourCue(SQUARE, 4000, motion, "window", "literal", 1.0)
    random = np.random.default_rng(0)
    for target in ((38.0, 26.0), (41.0, 27.0)):
        states = cue.sample(random)
        centres = states.mean(axis=1)
        weights = np.exp(-0.5 * ((centres - target) ** 2).sum(axis=1))
        weights /= weights.sum()
        cue.receive(states, weights)
        mean = weights @ centres
        np.testing.assert_allclose(cue.place.position, mean, atol=1e-9)
        np.testing.assert_allclose(
            cue.place.covariances[:, 0, 0], weights @ (centres - mean) ** 2, rtol=1e-9
        )


def test_equal_weights_tell_the_kalman_filter_next_to_nothing():
    motion = ContourDynamics(np.zeros((2, 2)), np.array([3.0, 2.0]))
    cue = KalmanContourCue(SQUARE, 200_00, motion, "window", "literal", 1.0)
    states = cue.sample(np.random.default_rng(0))
    before = cue.place.covariances[:, 0, 0].copy()
    cue.receive(states, np.full(len(states), 1 / len(states)))
    np.testing.assert_allclose(cue.place.covariances[:, 0, 0], before, rtol=0.05)
    np.testing.assert_allclose(cue.place.position, SQUARE.mean(axis=0), atol=0.2)


# Fits to the last frames.


def fit_of(seed, basis=BASIS):
    random = np.random.default_rng(seed)
    target, background = random.normal(0.6, 0.1, (300, 3)), random.normal(0.3, 0.2, (600, 3))
    return Fit(
        target,
        background,
        fitted(target @ basis, 2, random),
        fitted(background @ basis, 3, random),
    )


def test_blending_is_between_the_components_that_belong_together():
    older, newer = fit_of(0).background, fit_of(1).background
    shuffled = Mixture(*(part[[2, 0, 1]] for part in older))
    one, other = blended(older, newer, 0.3), blended(shuffled, newer, 0.3)
    for left, right in zip(one, other, strict=True):
        np.testing.assert_allclose(left, right)
    self_blend = blended(shuffled, older, 0.3)
    for left, right in zip(self_blend, older, strict=True):
        np.testing.assert_allclose(left, right)
    for left, right in zip(blended(older, newer, 1.0), newer, strict=True):
        np.testing.assert_allclose(left, right)
    assert one.weights.sum() == pytest.approx(1.0)


def test_the_prediction_mixes_the_last_two_fits():
    first = fit_of(0)
    colours = RefittedColours(first, 4, 0.3, Palettes(2, "literal", 1.0, 0.05))
    predicted = colours.sample(np.random.default_rng(0))
    np.testing.assert_allclose(predicted[2, :2], components_of(first.target))
    new = fit_of(5)
    colours.learn(new.target_colours, new.background_colours, BASIS, moved=False)
    second = first.of(new.target_colours, new.background_colours, BASIS)
    predicted = colours.sample(np.random.default_rng(0))
    expected = components_of(blended(first.target, second.target, 0.3))
    assert predicted.shape == (4, 5, 6)
    np.testing.assert_allclose(predicted[:, :2], np.repeat(expected[np.newaxis], 4, axis=0))
    last = fit_of(6)
    colours.learn(last.target_colours, last.background_colours, BASIS, moved=False)
    third = second.of(last.target_colours, last.background_colours, BASIS)
    expected = components_of(blended(second.background, third.background, 0.3))
    np.testing.assert_allclose(colours.sample(np.random.default_rng(0))[0, 2:], expected)


def test_on_another_plane_both_fits_are_made_anew():
    turned = np.linalg.qr(BASIS + 0.3)[0]
    first, new = fit_of(0), fit_of(5)
    colours = RefittedColours(first, 1, 1.0, Palettes(2, "literal", 1.0, 0.05))
    colours.learn(new.target_colours, new.background_colours, turned, moved=True)
    older, newer = colours.fits
    for fit, seen in ((older, first), (newer, new)):
        np.testing.assert_allclose(
            fit.target.weights @ fit.target.means,
            (seen.target_colours @ turned).mean(axis=0),
            atol=1e-6,
        )
