"""Round cones: coverage, occlusion, blur and light."""

import numpy as np
import pytest

from trackmark.datasets.synthetic.wang2010.hand import setting

HEAD_ON = np.array([0.0, 0.0, 1.0, 0.4])
"""Light from the camera."""


def cone(start, end, radii, material=setting.SKIN, colour=(100, 120, 140), crease=0, flat=0):
    row = [*start, radii[0], *end, radii[1], *colour, crease, material, flat]
    assert len(row) == setting.COLUMNS
    return row


def drawn(these, canvas=None, texture=None, lamp=HEAD_ON, motion=(0.0, 0.0)):
    """Return an image of cones that move by `motion` [pixels] during the exposure."""
    canvas = np.zeros((40, 60, 3), np.uint8) if canvas is None else canvas
    moments = np.repeat(np.array(these, np.float64)[None], setting.FINE, axis=0)
    for moment, shift in zip(moments, (np.arange(4) + 0.5) / 4 - 0.5, strict=True):
        moment[:, [0, 4]] += motion[0] * shift
        moment[:, [1, 5]] += motion[1] * shift
    frames = np.tile([0.0, 0.0, 1.0, 0.0], (setting.FINE, 2, 1))
    texture = np.ones((2, 64, 64)) if texture is None else texture
    setting.paint(canvas, moments, frames, texture, lamp)
    return canvas


def area(these, material=setting.SKIN):
    return setting.cover(np.array(these, np.float64), material, 40, 60).sum() / setting.FINE**2


@pytest.mark.parametrize(
    ("start", "flat", "expected"),
    [(45, 0, np.pi * 25), (15, 0, 30 * 10 + np.pi * 25), (15, 1, 30 * 10 + np.pi * 25 / 2)],
)
def test_cone_covers_the_hull_of_its_balls(start, flat, expected):
    covered = area([cone((start, 20, 0), (45, 20, 0), (5, 5), flat=flat)])
    assert covered == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(("depth", "seen"), [(-9, 0.0), (9, np.pi * 16)])
def test_nearer_cone_hides_the_farther_one(depth, seen):
    sleeve = cone((30, 20, 0), (30, 20, 0), (6, 6), setting.CLOTH)
    ball = cone((30, 20, depth), (30, 20, depth), (4, 4))
    assert area([sleeve, ball]) == pytest.approx(seen, rel=0.02)
    assert area([sleeve, ball], setting.CLOTH) == pytest.approx(np.pi * 36 - seen, rel=0.02)


def test_cones_are_clipped_at_the_border():
    assert area([cone((0, 20, 0), (0, 20, 0), (9, 9))]) == pytest.approx(np.pi * 81 / 2, rel=0.02)
    assert area([cone((-50, 20, 0), (-50, 20, 0), (9, 9))]) == 0


def test_cones_are_blended_by_their_coverage():
    these = [cone((30, 20, 0), (30, 20, 0), (9, 9), colour=(255, 255, 255))]
    black = drawn(these).astype(float)
    white = drawn(these, np.full((40, 60, 3), 255, np.uint8)).astype(float)
    share = 1 - (white - black).mean(axis=2) / 255
    expected = setting.cover(np.array(these, np.float64), setting.SKIN, 40, 60) / setting.FINE**2
    assert np.abs(share - expected).max() < 0.01


def test_cone_blur_follows_the_motion():
    these = [cone((30, 10, 0), (30, 30, 0), (4, 4))]
    still, moved = drawn(these).sum(axis=2), drawn(these, motion=(2.4, 0)).sum(axis=2)
    assert np.count_nonzero(moved[20]) >= np.count_nonzero(still[20]) + 1
    columns = np.arange(60) + 0.5
    for picture in (still[20], moved[20]):
        assert (picture * columns).sum() / picture.sum() == pytest.approx(30, abs=0.15)
    upright = drawn(these, motion=(0, 2.4)).sum(axis=2)
    assert np.count_nonzero(upright[20]) == np.count_nonzero(still[20])


def test_light_from_one_side_lights_that_side():
    picture = drawn([cone((30, 20, 0), (30, 20, 0), (9, 9))], lamp=np.array([-0.8, 0, 0.6, 0.3]))
    assert picture[20, 24, 1] > 1.3 * picture[20, 36, 1]
    up = drawn([cone((30, 20, 0), (30, 20, 0), (9, 9))], lamp=np.array([0, -0.8, 0.6, 0.3]))
    assert up[14, 30, 1] > 1.3 * up[26, 30, 1]


def test_texture_dims_only_its_material():
    texture = np.ones((2, 64, 64))
    texture[setting.CLOTH] = 0.5
    skin = cone((15, 20, 0), (15, 20, 0), (6, 6))
    cloth = cone((45, 20, 0), (45, 20, 0), (6, 6), setting.CLOTH)
    plain, dimmed = drawn([skin, cloth]).astype(int), drawn([skin, cloth], texture=texture)
    assert (plain[:, :30] == dimmed[:, :30]).all()
    assert dimmed[20, 45, 1] == pytest.approx(plain[20, 45, 1] / 2, abs=1)


def test_a_crease_darkens_the_first_end():
    these = [cone((15, 20, 0), (45, 20, 0), (5, 5), crease=0.4)]
    row = drawn(these)[20, :, 1]
    assert row[15] < 0.75 * row[30]
    assert row[40] == row[30]


def test_adjacent_cones_of_one_material_merge():
    """The dark line between two cylinders is weaker if they are of one material."""
    two = [cone((28, 5, 0), (28, 35, 0), (3, 3)), cone((32, 5, 0), (32, 35, 0), (3, 3))]
    apart = [two[0], cone((32, 5, 0), (32, 35, 0), (3, 3), setting.CLOTH)]
    assert drawn(two)[20, 29:31, 1].min() > drawn(apart)[20, 29:31, 1].min() + 3
