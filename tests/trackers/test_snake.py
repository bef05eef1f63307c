"""Snake, compared with a plain transcription and with circles in closed form."""

import numpy as np
import pytest
from scipy import ndimage
from scipy.interpolate import RegularGridInterpolator

from trackmark.trackers.contours.outline import fill_contour, inscribed_ellipse, outline
from trackmark.trackers.contours.snake import edge_map, fit_snake, refine_by_snake

CENTRE = np.array([40.0, 36.0])


def circle(radius, points=32, centre=CENTRE):
    angles = np.arange(points) * 2 * np.pi / points
    return centre + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def ridge(radius, width=4.0, size=(72, 80)):
    """Return edges with a smooth circular ridge."""
    rows, columns = np.indices(size) + 0.5
    distance = np.hypot(columns - CENTRE[0], rows - CENTRE[1])
    return np.exp(-((distance - radius) ** 2) / (2 * width**2))


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


def test_refinement_moves_a_contour_to_the_nearby_edge():
    mask, image = noisy_ellipse()
    around = outline(mask)
    start = around.mean(axis=0) + 1.08 * (around - around.mean(axis=0)) + [2.0, -1.0]
    actual, accepted = refine_by_snake(start, image, mask.astype(np.float32))
    assert accepted
    before, after = (fill_contour(contour, 180, 200) for contour in (start, actual))
    assert (after & mask).sum() / (after | mask).sum() > 0.965
    assert (before & mask).sum() / (before | mask).sum() < 0.87


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


@pytest.mark.parametrize("edge", [18.0, 22.0])
def test_snake_at_rest_stops_closer_to_an_edge(edge):
    start = circle(20)
    still = fit_snake(start, np.zeros((100, 100)), (0, 0), at_rest=True)
    np.testing.assert_allclose(still, start, atol=1e-9)
    actual = [fit_snake(start, ridge(edge), (0, 0), at_rest=rests) for rests in (False, True)]
    drawn_in, free = (edge - np.hypot(*(points - CENTRE).T).mean() for points in actual)
    # Stiffness pulls inwards, or towards the start if the snake is at rest there.
    assert drawn_in > 0.2
    assert abs(free) < 0.5 * drawn_in
    assert np.sign(free) == np.sign(edge - 20)


@pytest.mark.parametrize("times", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("stiffness", ["constant", "by-spacing"])
def test_circle_without_edges_shrinks_by_its_stiffness(stiffness, times):
    radius = times * 4.4 / (2 * np.sin(np.pi / 32))
    start = circle(radius, centre=np.array([200.0, 200.0]))
    actual, accepted = refine_by_snake(start, np.full((400, 400, 3), 90, np.uint8), None, stiffness)
    assert accepted
    # A circle is an eigenvector of the difference matrix. After 40 steps without edges:
    difference = 2 - 2 * np.cos(2 * np.pi / 32)
    ratio = 1.0 if stiffness == "constant" else 1 / times
    eigenvalue = 0.08 * ratio**2 * difference + 0.6 * ratio**4 * difference**2
    np.testing.assert_allclose(
        np.linalg.norm(actual - 200, axis=1), radius * (1 + eigenvalue) ** -40
    )
