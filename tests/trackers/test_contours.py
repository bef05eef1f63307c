"""Outlines, filled contours and snakes, compared with Shapely, SciPy and closed forms."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy import ndimage
from scipy.interpolate import RegularGridInterpolator
from shapely import LinearRing, Polygon

from trackmark.trackers.contours.outline import (
    _inside,
    bounding_box,
    contour_scores,
    crosses_itself,
    enclosed_area,
    fill_contour,
    inscribed_ellipse,
    outline,
)
from trackmark.trackers.contours.snake import edge_map, fit_snake, refine_by_snake


def blob(seed, height=40, width=50):
    """Return the largest part of a random mask, without holes; it may touch the border."""
    noise = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=(height, width)), 3)
    parts, _ = ndimage.label(noise > 0.02, np.ones((3, 3)))
    largest = parts == np.bincount(parts[parts > 0]).argmax()
    return ndimage.binary_fill_holes(largest)


@settings(max_examples=30)
@given(st.integers(0, 10_000))
def test_filled_outline_equals_the_mask(seed):
    mask = blob(seed)
    np.testing.assert_array_equal(fill_contour(outline(mask, 2000), *mask.shape), mask)


@pytest.mark.parametrize("seed", range(0, 8, 2))
def test_parts_touching_at_corners_have_one_outline(seed):
    mask = np.random.default_rng(seed).random((14, 19)) < 0.33 + 0.08 * seed
    parts, number = ndimage.label(mask, np.ones((3, 3)))
    whole = [ndimage.binary_fill_holes(parts == part) for part in range(1, number + 1)]
    actual = fill_contour(outline(mask, 4000), *mask.shape)
    assert max(area.sum() for area in whole) == actual.sum()
    assert any(np.array_equal(actual, area) for area in whole)


def test_outline_is_clockwise_and_equally_spaced():
    mask = blob(3)
    actual = outline(mask, 300)
    x, y = actual.T
    assert (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() > 0  # y points down
    rows, columns = np.nonzero(mask)
    assert actual[0].tolist() == [columns[rows == rows.min()].min() + 0.5, rows.min()]
    whole = outline(mask, 5000)
    lengths = np.hypot(*np.diff(whole, axis=0, append=whole[:1]).T)
    assert lengths == pytest.approx(lengths.mean(), rel=0.31)  # no more than a cut corner
    assert (outline(mask, 300) == actual).all()


def test_outline_of_an_empty_mask_is_rejected():
    with pytest.raises(ValueError, match="no pixel"):
        outline(np.zeros((5, 5), bool))


@given(st.integers(0, 10_000), st.integers(3, 12))
def test_contour_area_and_box_equal_those_of_shapely(seed, n):
    random = np.random.default_rng(seed)
    angles = np.sort(random.uniform(0, 2 * np.pi, n))
    radii = random.uniform(1, 9, n)
    contour = 200 + np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
    polygon = Polygon(contour)
    if polygon.is_valid:
        assert enclosed_area(contour) == pytest.approx(polygon.area, abs=1e-9)
    left, top, right, bottom = polygon.bounds
    assert bounding_box(contour) == pytest.approx([left, top, right - left, bottom - top])


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=4, max_size=8))
@example([(0, 0), (1, 0), (1, 1), (2, 1), (2, 0), (3, 0), (3, 2), (0, 2)])  # sides on one line
def test_crosses_itself_equals_shapely(points):
    contour = np.array(points, dtype=float)
    before, after = contour - np.roll(contour, 1, axis=0), np.roll(contour, -1, axis=0) - contour
    # Shapely counts sides that fold back and empty sides as crossings.
    assume((before[:, 0] * after[:, 1] != before[:, 1] * after[:, 0]).all())
    assert crosses_itself(contour) == (not LinearRing(contour).is_simple)


HEIGHT, WIDTH = 13, 17


@st.composite
def star_shaped(draw):
    """Draw a star-shaped contour on a grid that contains the pixel centres."""
    x, y = draw(st.integers(-8, 76)), draw(st.integers(-8, 60))  # quarters of a pixel
    rays = draw(
        st.lists(
            st.tuples(st.integers(-24, 24), st.integers(-24, 24)).filter(lambda ray: ray != (0, 0)),
            min_size=3,
            max_size=12,
            unique_by=lambda ray: np.arctan2(ray[1], ray[0]),
        )
    )
    rays.sort(key=lambda ray: np.arctan2(ray[1], ray[0]))
    contour = np.array([(x + across, y + down) for across, down in rays]) / 4
    if draw(st.booleans()):
        contour = contour[::-1]
    return np.ascontiguousarray(contour)


def is_inside(x, y, contour):
    """Return whether an upward ray crosses the contour an odd number of times, exactly."""
    inside = False
    points = [[Fraction(number) for number in point] for point in contour.tolist()]
    for (a, b), (c, d) in zip(points, points[1:] + points[:1], strict=True):
        if min(a, c) <= x < max(a, c) and b + (x - a) * (d - b) / (c - a) <= y:
            inside = not inside
    return inside


def pixels_inside(contour, height=HEIGHT, width=WIDTH):
    half = Fraction(1, 2)
    return np.array(
        [[is_inside(x + half, y + half, contour) for x in range(width)] for y in range(height)]
    )


@settings(max_examples=25)
@given(star_shaped().filter(lambda contour: Polygon(contour).is_valid), st.integers(0, 99))
def test_filled_pixels_and_sums_equal_ray_casting(contour, seed):
    values = np.random.default_rng(seed).normal(size=(HEIGHT, WIDTH))
    inside = pixels_inside(contour)
    np.testing.assert_array_equal(fill_contour(contour, HEIGHT, WIDTH), inside)
    above = np.concatenate([np.zeros((1, WIDTH)), values.cumsum(axis=0)])
    for way in (contour, contour[::-1].copy()):
        total, count = _inside(above, way, 0, 0)
        assert count == inside.sum()
        assert total == pytest.approx(values[inside].sum(), abs=1e-12)


def scene(seed, n=40, maps=7, k=90, height=60, width=80):
    random = np.random.default_rng(seed)
    tables = random.random((maps, k), dtype=np.float32)
    cells = random.integers(0, k, (height, width)).astype(np.int32)
    angles = np.arange(20) * 2 * np.pi / 20
    radii = random.uniform(6, 13, (n, 20))
    around = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    centres = random.uniform((22, 20), (52, 38), (n, 1, 2))
    contours = centres + radii[:, :, None] * around
    return tables, cells, random.integers(0, maps, n), contours


@pytest.mark.parametrize("outside", ["window", "image"])
def test_contour_score_is_mean_inside_minus_mean_outside(outside):
    tables, cells, which, contours = scene(0)
    window = (7, 5, 70, 55)
    scores = contour_scores(tables, cells, which, contours, window, outside, 1)
    occupied = np.zeros(cells.shape, bool)
    occupied[5:55, 7:70] = True
    beyond = occupied if outside == "window" else np.ones_like(occupied)
    for j, contour in enumerate(contours):
        values = tables[which[j]][cells].astype(np.float64)
        inside = fill_contour(contour, *cells.shape) & occupied
        expected = values[inside].mean() - values[beyond & ~inside].mean()
        assert scores[j] == pytest.approx(expected, abs=1e-12)


def test_contour_scores_reject_small_and_full_contours():
    tables, cells, which, contours = scene(1, n=1)
    inside = int(fill_contour(contours[0], *cells.shape).sum())
    window = (0, 0, 80, 60)
    assert contour_scores(tables, cells, which, contours, window, smallest=inside)[0] > -1
    assert contour_scores(tables, cells, which, contours, window, smallest=inside + 1)[0] == -1
    around = np.array([[[-1.0, -1], [90, -1], [90, 90], [-1, 90]]])
    assert contour_scores(tables, cells, which, around, window)[0] == -1
    assert contour_scores(tables, cells, which, around, (5, 5, 60, 50), "image")[0] > -1


CENTRE = np.array([40.0, 36.0])


def circle(radius, points=32, centre=CENTRE):
    angles = np.arange(points) * 2 * np.pi / points
    return centre + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def transcription(contour, edges, origin, alpha, beta, gamma, kappa, iterations):
    """Return the fitted contour, computed with an inverse matrix and SciPy's interpolator."""
    n = len(contour)
    shift = np.roll(np.eye(n), 1, axis=1)
    a = alpha * (2 * np.eye(n) - shift - shift.T)
    a += beta * (shift @ shift - 4 * shift + 6 * np.eye(n) - 4 * shift.T + shift.T @ shift.T)
    inverse = np.linalg.inv(a + gamma * np.eye(n))
    grid = tuple(np.arange(length) + 0.5 for length in edges.shape)
    slopes = RegularGridInterpolator(grid, np.stack(np.gradient(edges), axis=2))
    points = contour - origin
    for _ in range(iterations):
        last = np.array(edges.shape) - 0.5
        force = kappa * slopes(np.clip(points[:, ::-1], 0.5, last))[:, ::-1]
        force /= np.maximum(np.hypot(*force.T), 1)[:, None]
        points = inverse @ (gamma * points + force)
    return points + origin


@pytest.mark.parametrize("points", [31, 32])
@pytest.mark.parametrize("attraction", [3.0, 40.0])
def test_a_snake_is_the_plain_transcription(points, attraction):
    random = np.random.default_rng(0)
    edges = ndimage.gaussian_filter(random.random((50, 60)), 2)
    edges /= edges.max()
    start = circle(22, points, np.array([45.0, 40.0])) + random.normal(size=(points, 2))
    origin = (7, 11)
    actual = fit_snake(start, edges, origin, 0.08, 0.6, 0.8, attraction, 25)
    expected = transcription(start, edges, origin, 0.08, 0.6, 0.8, attraction, 25)
    np.testing.assert_allclose(actual, expected, atol=1e-9)
    assert abs(actual - start).max() > 1


def noisy_ellipse(seed=0):
    mask = inscribed_ellipse(np.array([60.0, 50.0, 70.0, 90.0]), 180, 200)
    image = np.full((180, 200, 3), 60.0)
    image[mask] = 200, 30, 90
    image += np.random.default_rng(seed).normal(0, 8, image.shape)
    return mask, image.clip(0, 255).astype(np.uint8)


@pytest.mark.parametrize("supported", [True, False])
def test_edge_map_is_the_product_of_smoothed_gradients(supported):
    mask, image = noisy_ellipse()

    def slope(values, sigma):
        smooth = ndimage.gaussian_filter(values, sigma, mode="mirror")
        return np.hypot(*(ndimage.sobel(smooth, axis, mode="mirror") / 8 for axis in (0, 1)))

    channels = [slope(image[..., k].astype(float), 1.2) for k in range(3)]
    expected = np.sqrt(np.square(channels).sum(axis=0))
    posterior = ndimage.gaussian_filter(mask.astype(np.float32), 1)
    if supported:
        expected *= slope(posterior.astype(float), 2.0)
    expected = ndimage.gaussian_filter(expected, 1.5, mode="mirror")
    actual = edge_map(image, posterior if supported else None)
    np.testing.assert_allclose(actual, expected / expected.max(), atol=2e-3)
    assert actual.max() == 1


def test_collapsed_or_crossing_snake_is_rejected():
    flat = np.full((72, 80, 3), 90, np.uint8)
    start = circle(15, 8)  # so few points that nothing holds them apart
    actual, accepted = refine_by_snake(start, flat, None)
    assert not accepted
    assert actual is start
    eight = np.array([[20.0, 20], [60, 50], [60, 20], [20, 50]]).repeat(8, axis=0)
    eight += np.tile(np.linspace(0, 1, 8)[:, None], (4, 1)) * (np.roll(eight, -8, axis=0) - eight)
    assert not refine_by_snake(eight, flat, None)[1]


def test_contour_far_outside_the_image_is_unchanged():
    flat = np.full((72, 80, 3), 90, np.uint8)
    for shift in ([400.0, 0.0], [-400.0, 0.0], [0.0, -400.0]):
        start = circle(15) + shift
        actual, accepted = refine_by_snake(start, flat, None)
        assert actual is start
        assert not accepted


@pytest.mark.parametrize("times", [1.0, 2.0, 4.0])
def test_circle_without_edges_shrinks_by_its_spacing(times):
    radius = times * 4.4 / (2 * np.sin(np.pi / 32))
    start = circle(radius, centre=np.array([200.0, 200.0]))
    actual, accepted = refine_by_snake(start, np.full((400, 400, 3), 90, np.uint8), None)
    assert accepted
    # A circle is an eigenvector of the difference matrix. After 40 steps without edges:
    difference = 2 - 2 * np.cos(2 * np.pi / 32)
    eigenvalue = 0.08 / times**2 * difference + 0.6 / times**4 * difference**2
    np.testing.assert_allclose(
        np.linalg.norm(actual - 200, axis=1), radius * (1 + eigenvalue) ** -40
    )
