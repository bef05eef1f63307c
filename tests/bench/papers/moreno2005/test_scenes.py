"""What is measured on scenes, on images and runs of which it is known."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import datasets
from bench.papers.moreno2005 import scenes
from bench.papers.moreno2005.scenes import contrast, drawn_colours
from bench.papers.scenes import short_runs

TARGET = "plain/target:length=12"


def halves(left, right, size=60):
    """An image (BGR) of two halves, and the mask of the left one's middle."""
    image = np.empty((size, size, 3), np.uint8)
    image[:, : size // 2], image[:, size // 2 :] = left, right
    mask = np.zeros((size, size), bool)
    mask[:, : size // 2] = True
    return image, mask


def test_colours_are_drawn_from_where_they_are_meant_to_be():
    image, mask = halves((255, 51, 0), (0, 0, 255))
    inside, outside = drawn_colours(image, mask, np.random.default_rng(0), 0.1)
    assert (inside.shape, outside.shape) == ((50, 3), (150, 3))
    np.testing.assert_allclose(inside, np.tile([0, 0.2, 1], (50, 1)))
    np.testing.assert_allclose(outside, np.tile([1.0, 0, 0], (150, 1)))


def test_contrast_is_that_of_what_is_near():
    image, mask = halves((255, 255, 255), (0, 0, 0), 100)
    assert contrast(image, mask) == pytest.approx(np.sqrt(3))
    image[:, 50:63] = 255  # all that is within twelve pixels
    assert contrast(image, mask) == pytest.approx(0.0)
    image[:, 50:56] = 0
    assert 0.5 < contrast(image, mask) < 1.3


def coloured(generator, means, spread=0.02, number=400):
    """Colours about some means, as many of each."""
    drawn = [generator.normal(mean, spread, (number, 3)) for mean in means]
    return np.clip(np.concatenate(drawn), 0, 1)


def test_brightness_alone_is_told_apart_on_planes_and_not_by_chromaticity():
    generator = np.random.default_rng(1)
    sets = [tuple(coloured(generator, [[level] * 3]) for level in (0.8, 0.4)) for _ in range(2)]
    on_plane = scenes.told_apart(lambda c: c[:, :2], *sets, generator)
    by_chromaticity = scenes.told_apart(scenes.chromaticity, *sets, generator)
    assert on_plane > 0.99
    assert by_chromaticity < 0.75


def test_classes_count_alike_whatever_their_numbers():
    generator = np.random.default_rng(2)
    target, background = (
        coloured(generator, [[0.2] * 3], number=50),
        coloured(generator, [[0.8] * 3], number=2000),
    )
    asked = np.concatenate([target[:25], background[:25]]), background
    known = target, background
    # Half of what is asked as target looks like background.
    share = scenes.told_apart(lambda c: c[:, :2], known, asked, generator)
    assert share == pytest.approx(0.75, abs=0.01)


def test_chromaticity_is_the_share_of_red_and_green_and_black_has_a_third():
    found = scenes.chromaticity(np.array([[0.5, 0.25, 0.25], [1.0, 0.5, 0.5], [0, 0, 0]]))
    np.testing.assert_allclose(found, [[0.5, 0.25], [0.5, 0.25], [1 / 3, 1 / 3]])


def test_principal_components_are_those_of_greatest_variance():
    generator = np.random.default_rng(3)
    colours = generator.normal(size=(4000, 3)) * [0.1, 3.0, 1.0]
    basis = scenes.principal_basis(colours)
    np.testing.assert_allclose(np.abs(basis), [[0, 0], [1, 0], [0, 1]], atol=0.05)


def test_all_spaces_are_measured_on_a_sequence():
    table = scenes.spaces(datasets.load(TARGET), quick=True)["mo-20"]
    assert table["space"].tolist() == [
        "Fisher plane",
        "chromaticity",
        "principal components",
        "random planes",
    ]
    assert table["told_apart"].between(0.5, 1).all()


def test_starts_stray_as_the_dynamics_say():
    square = np.array([[0.0, 0], [100, 0], [100, 100], [0, 100]])
    generator = np.random.default_rng(4)
    drawn = np.array([scenes.started(square, generator) for _ in range(4000)])
    middles = drawn.mean(axis=1)
    np.testing.assert_allclose(middles.mean(axis=0), [50, 50], atol=0.2)
    np.testing.assert_allclose(middles.std(axis=0), scenes.SHIFT, rtol=0.1)
    widths = (drawn[:, 1] - drawn[:, 0])[:, 0] / 100
    assert widths.std() == pytest.approx(scenes.STRETCH, rel=0.1)


def test_the_map_shows_the_target_by_colours_of_the_frame_before():
    image, mask = halves((200, 60, 40), (30, 140, 220))
    noisy = np.clip(image + np.random.default_rng(5).normal(0, 4, image.shape), 0, 255)
    image = noisy.astype(np.uint8)
    shown = scenes.posterior_map(image, mask, image[:, ::-1], np.random.default_rng(6))
    assert (shown.dtype, shown.shape) == (np.float32, mask.shape)
    assert shown[:, 31:].min() > 0.9
    assert shown[:, :29].max() < 0.1


def test_both_images_of_edges_are_measured_from_the_same_starts():
    table = scenes.edges(datasets.load(TARGET), quick=True)["mo-21"]
    assert table["edges"].tolist() == ["supported", "all"]
    assert (table[["contour_accuracy", "region_similarity"]] > 0.5).all(axis=None)
    assert table["accepted"].between(0, 1).all()


def test_masks_of_one_run_are_compared_frame_by_frame():
    sequence = datasets.load(TARGET)
    (run,) = short_runs(sequence, ["moreno2005:contour_samples=30:colour_samples=30"])
    table = scenes.frame_rows(sequence, run)
    assert sorted(table["mask"].unique()) == ["contour", "mean contour", "posterior map"]
    assert table["frame"].nunique() == 11
    ours = table[table["mask"] == "contour"].set_index("frame")["region_similarity"]
    stored = run.segmentation.region_similarity
    np.testing.assert_array_equal(ours, stored[ours.index])


def test_the_map_is_cut_at_one_half_and_the_mean_contour_filled():
    sequence = datasets.load(TARGET)
    truth = sequence.mask(3)
    rows, columns = np.nonzero(truth)
    left, top, right, bottom = columns.min(), rows.min(), columns.max() + 1, rows.max() + 1
    box = np.array([[left, top], [right, top], [right, bottom], [left, bottom]], np.float32)
    arrays = {"mask": ~truth, "mean_contour": box, "posterior": np.where(truth, 0.51, 0.49)}
    table = scenes.frame_rows(sequence, SimpleNamespace(arrays={3: arrays, 4: {}}))
    found = table.set_index("mask")["region_similarity"]
    assert (found["contour"], found["posterior map"]) == (0.0, 1.0)
    area = (right - left) * (bottom - top)
    assert found["mean contour"] == pytest.approx(truth.sum() / area)


def test_quarters_are_taken_by_contrast_and_all_frames_beside():
    frames = pd.DataFrame(
        {
            "mask": mask,
            "frame": k,
            "distance": (k * 3) % 8 / 8,
            "region_similarity": (k * 3) % 8 / 8 + (mask == "contour"),
        }
        for mask in ("contour", "posterior map")
        for k in range(8)
    )
    found = scenes.by_contrast(frames).set_index(["mask", "contrast"])
    assert set(found.index.get_level_values(1)) == {"all", *scenes.QUARTERS}
    for mask, more in (("contour", 1.0), ("posterior map", 0.0)):
        rows = found.loc[mask]
        assert rows.loc["all", "region_similarity"] == pytest.approx(3.5 / 8 + more)
        means = [rows.loc[name, "distance"] for name in scenes.QUARTERS]
        assert means == pytest.approx([0.5 / 8, 2.5 / 8, 4.5 / 8, 6.5 / 8])
        assert all(low < high for low, high in pairwise(means))
