"""Chain of dependent cues, and cues of `moreno2005`."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trackmark import trackers
from trackmark.trackers.contours.chain import (
    Chain,
    Weighed,
    complete_combinations,
)
from trackmark.trackers.contours.contour_cue import KalmanContourCue
from trackmark.trackers.contours.observation import colour_cells
from trackmark.trackers.contours.plane_cue import (
    discriminant_basis,
    orient_normals,
    plane_basis,
    plane_normal,
)


class TableCue:
    """Cue with fixed states and a table of weights; a second cue has a row per attached state."""

    def __init__(self, states, table):
        self.states, self.table, self.received = np.asarray(states), np.asarray(table), None

    def sample(self, generator):
        return self.states

    def weigh(self, observation, states, attached, earlier):
        if attached is None:
            return Weighed(self.table[states], evidence="first")
        assert earlier[-1].evidence == "first"
        return Weighed(self.table[earlier[-1].states[attached], states])

    def receive(self, states, weights):
        self.received = (states, weights)


def test_complete_density_has_exact_probabilities():
    table = [[0.9, 0.1], [0.4, 0.6], [0.2, 0.3]]
    states = np.random.default_rng(7).integers(0, 2, 200_000)
    chain = Chain([TableCue([0, 1, 2], [0.2, 0.5, 0.3]), TableCue(states, table)])
    first, second = chain.step(None, np.random.default_rng(0))
    indices = complete_combinations((first, second))
    measured = np.zeros((3, 2))
    np.add.at(measured, (first.states[indices[0]], second.states), second.weights)
    exact = np.array([0.2, 0.5, 0.3])[:, np.newaxis] * table
    np.testing.assert_allclose(measured, exact / exact.sum(), atol=0.006)


SQUARE = np.array([[20.0, 10.0], [50.0, 10.0], [50.0, 40.0], [20.0, 40.0]])


@pytest.fixture(scope="module")
def image():
    random = np.random.default_rng(4)
    picture = random.integers(0, 120, (60, 80, 3))
    picture[10:40, 20:50] = random.integers(100, 255, (30, 30, 3))
    return picture.astype(np.uint8)


@pytest.mark.parametrize("levels", [1, 20, 64])
def test_colour_cells_have_the_mean_of_their_pixels(image, levels):
    coarse = image.copy()
    coarse[:30] = coarse[:30] // 64 * 85  # cells of many pixels, and extreme ones
    rgb = coarse[..., ::-1].reshape(-1, 3).astype(int)
    _, numbers, sizes = np.unique(
        rgb * levels // 256, axis=0, return_inverse=True, return_counts=True
    )
    cells = colour_cells(coarse, levels)
    np.testing.assert_array_equal(cells.image, numbers.reshape(60, 80))
    np.testing.assert_array_equal(cells.sizes, sizes)
    means = [rgb[numbers == cell].mean(axis=0) / 255 for cell in range(len(sizes))]
    np.testing.assert_allclose(cells.colours, means, rtol=1e-13)


def test_kalman_contour_cue_matches_weighted_mean_and_variance():
    names = ("stretch_x_spread", "shear_x_spread", "shear_y_spread", "stretch_y_spread")
    spreads = {**dict.fromkeys(names, 0.0), "shift_x_spread": 3.0, "shift_y_spread": 2.0}
    specification = trackers.resolve("moreno2005", contour_samples=4000, **spreads)
    cue = KalmanContourCue(SQUARE, specification.parameters, 320)
    random = np.random.default_rng(0)
    for target in ((38.0, 26.0), (41.0, 27.0)):
        states = cue.sample(random)
        centres = states.mean(axis=1)
        weights = np.exp(-0.5 * ((centres - target) ** 2).sum(axis=1))
        weights /= weights.sum()
        cue.receive(states, weights)
        mean = weights @ centres
        np.testing.assert_allclose(cue.motion.position, mean, atol=1e-9)
        np.testing.assert_allclose(
            cue.motion.covariances[:, 0, 0], weights @ (centres - mean) ** 2, rtol=1e-9
        )


def colours(seed, n_target=40, n_background=70):
    """Return two overlapping clouds of different shape."""
    rng = np.random.default_rng(seed)
    target = rng.normal([0.5, 0.4, 0.6], [0.05, 0.12, 0.03], (n_target, 3))
    background = rng.uniform(0.2, 0.7, (n_background, 3)) + rng.normal(0, 0.05, (n_background, 3))
    return target, background


def slow_scatter(target, background, k, exponent):
    """Return whitening matrix (rows are axes) and between-class scatter, pixel by pixel."""
    within = 0.5 * np.cov(target.T, bias=True) + 0.5 * np.cov(background.T, bias=True)
    values, axes = np.linalg.eigh(within + 1e-4 * np.eye(3))
    whitening = np.diag(values**-0.5) @ axes.T
    classes = [[whitening @ colour for colour in a_class] for a_class in (target, background)]
    scatter = np.zeros((3, 3))
    for own_class, other in ([0, 1], [1, 0]):
        for i, colour in enumerate(classes[own_class]):
            companions = [neighbour for j, neighbour in enumerate(classes[own_class]) if j != i]
            near = sorted(np.linalg.norm(colour - neighbour) for neighbour in companions)[k - 1]
            others = sorted(
                classes[other], key=lambda neighbour: np.linalg.norm(colour - neighbour)
            )[:k]
            far = np.linalg.norm(colour - others[k - 1])
            weight = min(near**exponent, far**exponent) / (near**exponent + far**exponent)
            difference = colour - sum(others) / k
            scatter += 0.5 / len(classes[own_class]) * weight * np.outer(difference, difference)
    return whitening, scatter


@pytest.mark.parametrize(("k", "exponent"), [(3, 1.0), (1, 1.0), (5, 2.0), (3, 0.0)])
def test_discriminant_axes_equal_the_slow_definition(k, exponent):
    target, background = colours(k)
    whitening, scatter = slow_scatter(target, background, k, exponent)
    values, vectors = np.linalg.eigh(scatter)
    assert values[2] > 1.02 * values[1] > 1.02**2 * values[0], "axes must be distinct to compare"
    first, second = (whitening.T @ vectors[:, column] for column in (2, 1))
    first = first / np.linalg.norm(first)
    second = second - (second @ first) * first
    second = second / np.linalg.norm(second)
    basis = discriminant_basis(target, background, k, exponent)
    np.testing.assert_allclose(np.abs(basis.T @ np.stack([first, second]).T), np.eye(2), atol=1e-9)
    assert ((target.mean(axis=0) - background.mean(axis=0)) @ basis >= 0).all()


def test_discriminant_axis_connects_uniform_classes():
    flat = discriminant_basis(np.full((9, 3), 0.2), np.tile([0.2, 0.2, 0.5], (9, 1)))
    np.testing.assert_allclose(flat[:, 0], [0, 0, -1], atol=1e-9)
    same = discriminant_basis(np.full((9, 3), 0.2), np.full((9, 3), 0.2))
    np.testing.assert_allclose(same.T @ same, np.eye(2), atol=1e-12)


def test_class_of_too_few_colours_is_rejected():
    target, background = colours(0, 3, 20)
    with pytest.raises(ValueError, match="3 colours of the target and 20 of the background"):
        discriminant_basis(target, background)
    with pytest.raises(ValueError, match="20 colours of the target and 3 of the background"):
        discriminant_basis(background, target)


def unit_vectors(seed, n):
    vectors = np.random.default_rng(seed).normal(size=(n, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


REFERENCE = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 2)))[0]


def test_plane_basis_is_the_smallest_rotation():
    reference = plane_normal(REFERENCE)
    normals = orient_normals(unit_vectors(5, 30), reference)
    for normal, basis in zip(normals, plane_basis(normals, REFERENCE), strict=True):
        axis = np.cross(reference, normal)
        angle = np.arccos(reference @ normal)
        turn = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
        np.testing.assert_allclose(basis, turn.apply(REFERENCE.T).T, atol=1e-12)
        np.testing.assert_allclose(basis.T @ basis, np.eye(2), atol=1e-12)
        np.testing.assert_allclose(plane_normal(basis), normal, atol=1e-12)
