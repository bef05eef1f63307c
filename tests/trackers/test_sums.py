"""Sums inside contours, against a walk over all pixels in exact arithmetic."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon

from trackers.contours.outline import _inside, contour_scores, filled, windings

HEIGHT, WIDTH = 13, 17


@st.composite
def star_shaped(draw):
    """A contour that does not cross itself, on a grid that has the centres of pixels."""
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
    """Whether a ray upwards crosses the contour an odd number of times, in exact arithmetic."""
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


@settings(max_examples=40)
@given(star_shaped().filter(lambda contour: Polygon(contour).is_valid), st.integers(0, 99))
def test_filled_pixels_have_their_centres_inside_and_sums_are_theirs(contour, seed):
    values = np.random.default_rng(seed).normal(size=(HEIGHT, WIDTH))
    inside = pixels_inside(contour)
    np.testing.assert_array_equal(filled(contour, HEIGHT, WIDTH), inside)
    above = np.concatenate([np.zeros((1, WIDTH)), values.cumsum(axis=0)])
    for way in (contour, contour[::-1].copy()):
        total, count = _inside(above, way, 0, 0)
        assert count == inside.sum()
        assert total == pytest.approx(values[inside].sum(), abs=1e-12)


@given(
    st.lists(st.floats(-0.4, 0.4), min_size=9, max_size=9),
    st.integers(0, 8),
    st.integers(0, 8),
)
def test_contours_that_share_a_side_share_no_pixel_and_leave_none_out(bends, first, last):
    angles = np.arange(9) * 2 * np.pi / 9
    radii = 5 + 3 * np.array(bends)
    whole = np.stack([8.5 + radii * np.cos(angles), 6.5 + radii * np.sin(angles)], axis=1)
    first, last = sorted((first, last))
    centre = np.array([[8.5, 6.5]])
    one = np.concatenate([whole[first : last + 1], centre])
    other = np.concatenate([whole[last:], whole[: first + 1], centre])
    together = filled(one, HEIGHT, WIDTH).astype(int) + filled(other, HEIGHT, WIDTH)
    np.testing.assert_array_equal(together, filled(whole, HEIGHT, WIDTH))


def test_windings_have_the_direction_and_the_number_of_turns():
    square = np.array([[2.0, 2], [6, 2], [6, 6], [2, 6]])
    once = windings(square, 8, 8)
    assert abs(once).tolist() == filled(square, 8, 8).astype(int).tolist()
    assert (windings(square[::-1].copy(), 8, 8) == -once).all()
    assert (windings(np.concatenate([square, square]), 8, 8) == 2 * once).all()


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
def test_scores_are_means_inside_less_means_outside(outside):
    tables, cells, which, contours = scene(0)
    window = (7, 5, 70, 55)
    scores = contour_scores(tables, cells, which, contours, window, outside, 1)
    there = np.zeros(cells.shape, bool)
    there[5:55, 7:70] = True
    beyond = there if outside == "window" else np.ones_like(there)
    for j, contour in enumerate(contours):
        values = tables[which[j]][cells].astype(np.float64)
        inside = filled(contour, *cells.shape) & there
        expected = values[inside].mean() - values[beyond & ~inside].mean()
        assert scores[j] == pytest.approx(expected, abs=1e-12)


def test_a_contour_with_few_pixels_inside_or_none_outside_has_the_worst_score():
    tables, cells, which, contours = scene(1, n=1)
    inside = int(filled(contours[0], *cells.shape).sum())
    window = (0, 0, 80, 60)
    assert contour_scores(tables, cells, which, contours, window, smallest=inside)[0] > -1
    assert contour_scores(tables, cells, which, contours, window, smallest=inside + 1)[0] == -1
    around = np.array([[[-1.0, -1], [90, -1], [90, 90], [-1, 90]]])
    assert contour_scores(tables, cells, which, around, window)[0] == -1
    # Where there is more of the image than the window, something is left outside.
    assert contour_scores(tables, cells, which, around, (5, 5, 60, 50), "image")[0] > -1
