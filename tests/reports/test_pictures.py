"""Film strips and videos: positions of their boxes."""

import av
import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackmark.reports.overlay import (
    STRIP_WIDTH,
    TRUTH,
    evenly_spaced,
    film_strip,
    legend,
    overlay,
    save_png,
    write_line,
)
from trackmark.reports.palette import colour, to_bgr
from trackmark.reports.video import save_video

GREY = np.full((60, 80, 3), 128, np.uint8)


def on_grey(box, scale=1.0, shape="box", position=0):
    return overlay(GREY, {"a": np.array(box)}, {"a": colour(position)}, scale, shape=shape)


def changed(drawn):
    return np.argwhere((drawn != 128).any(axis=2))


def is_colour(pixels, position, within=40):
    """Return whether pixels, shape (..., 3), have the colour with an index."""
    return np.abs(pixels.astype(int) - to_bgr(colour(position))).max(axis=-1) < within


def test_overlay_draws_only_the_edges_of_a_box():
    drawn = on_grey([20, 10, 30, 25])
    y, x = changed(drawn).T + 0.5
    outside = np.max([20 - x, x - 50, 10 - y, y - 35, 0 * x], axis=0)
    to_edges = np.min(np.abs([x - 20, x - 50, y - 10, y - 35]), axis=0)
    assert max(outside.max(), to_edges.max()) <= 4
    for row, column in ((10, 35), (34, 35), (20, 20), (20, 49)):
        assert (drawn[row, column] != 128).any()


@pytest.mark.parametrize("scale", [1.0, 1.37])
def test_overlay_draws_box_with_subpixel_accuracy(scale):
    errors = []
    for part in np.linspace(0, 2, 33):
        drawn = on_grey([10 + part, 8 + part, 40, 30], scale)
        height, width = drawn.shape[:2]
        difference = np.abs(drawn.astype(float) - 128).sum(axis=2)
        left = difference[height // 2, : width // 2]
        top = difference[: height // 2, width // 2]
        for profile, place in ((left, (10 + part) * width / 80), (top, (8 + part) * height / 60)):
            centre = (profile * (np.arange(len(profile)) + 0.5)).sum() / profile.sum()
            errors.append(centre - place)
    # OpenCV inks the two sides of a line unevenly, by up to 0.27 pixels of the drawing.
    assert np.abs(errors).max() < 0.3
    assert abs(np.mean(errors)) < 0.1


def test_overlay_inscribes_ellipse_in_box():
    scale = 3.0
    y, x = (changed(on_grey([20, 10, 40, 30], scale, "ellipse")).T + 0.5) / scale
    radius = np.hypot((x - 40) / 20, (y - 25) / 15)
    assert np.abs(radius - 1).max() * 15 * scale < 4.5
    angles = np.degrees(np.arctan2((y - 25) / 15, (x - 40) / 20)).round()
    assert len(set(angles % 360)) > 100  # all the way round
    assert (x.min(), x.max()) == (pytest.approx(20, abs=3), pytest.approx(60, abs=3))


def test_overlay_closes_contours_and_separates_parts():
    first = np.array([[10.0, 10], [30, 10], [30, 30]])
    second = np.array([[50.0, 30], [70, 30], [70, 50]])
    gap = np.full((1, 2), np.nan)
    drawn = on_grey(np.vstack([first, gap, second, gap]), shape="contour")
    for part in (first, second):
        for start, stop in zip(part, np.roll(part, -1, axis=0), strict=True):
            x, y = ((start + stop) / 2 - 0.5).astype(int)
            assert (drawn[y - 1 : y + 2, x - 1 : x + 2] != 128).any()
    alone = [changed(on_grey(part, shape="contour")) for part in (first, second)]
    assert len(changed(drawn)) == sum(map(len, alone))


@pytest.mark.parametrize("ground", [0, 128, 255])
def test_overlay_shows_ground_truth_on_any_background(ground):
    image = np.full((60, 80, 3), ground, np.uint8)
    drawn = overlay(image, {TRUTH: np.array([10.125, 10.125, 60, 40])}, {}, scale=4)
    top = drawn[40, 46:276]
    assert top.max() > 230
    assert top.min() < 25
    dashes = np.diff((top[:, 0] > 128).astype(int)).clip(0).sum()
    assert dashes == pytest.approx(240 / 8, abs=2)


@pytest.mark.parametrize("shape", ["ellipse", "contour"])
def test_overlay_dashes_ground_truth_of_any_shape(shape):
    angles = np.linspace(0, 2 * np.pi, 200)
    circle = 100 + 80 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    truth = np.array([20, 20, 160, 160]) if shape == "ellipse" else circle[::4]
    image = np.zeros((200, 200, 3), np.uint8)
    drawn = overlay(image, {TRUTH: truth}, {}, shape=shape)
    dashes, _, _, centres = cv2.connectedComponentsWithStats((drawn[..., 0] > 110).astype(np.uint8))
    assert dashes - 1 == pytest.approx(np.pi * 160 / 8, rel=0.25)
    np.testing.assert_allclose(np.hypot(*(centres[1:] - 99.5).T), 80, atol=1.0)
    around = np.sort(np.arctan2(*(centres[1:] - 99.5).T))
    assert np.diff(around).max() < 1.5 * 2 * np.pi / len(around)


def test_overlay_shows_box_at_ground_truth_between_dashes():
    box = np.array([10.125, 10.125, 60, 40])
    drawn = overlay(GREY, {TRUTH: box, "a": box}, {"a": colour(0)}, scale=4)
    top = drawn[40, 46:276]
    assert is_colour(top, 0).mean() > 0.25
    assert (top.min(axis=1) > 180).mean() > 0.25


def test_overlay_accepts_absent_and_distant_boxes():
    before = GREY.copy()
    boxes = {"a": np.full(4, np.nan), "b": np.array([-1e9, -1e9, 1e12, 5])}
    drawn = overlay(GREY, boxes, {"a": colour(0), "b": colour(1)}, caption="7")
    assert drawn.shape == GREY.shape
    assert np.array_equal(on_grey(np.full(4, np.nan)), GREY)
    assert np.array_equal(on_grey(np.empty((0, 2)), shape="contour"), GREY)
    assert np.array_equal(GREY, before)


def test_legend_wraps_long_labels():
    labels = {f"tracker-with-a-long-name-{i}": colour(i) for i in range(6)}
    assert legend(labels, labels, 2000).shape[0] < legend(labels, labels, 400).shape[0]
    assert legend(labels, labels, 400).shape[1] == 400


@given(st.integers(0, 50), st.integers(0, 500), st.integers(1, 40))
def test_evenly_spaced_includes_first_and_last_frame(first, more, count):
    numbers = evenly_spaced(first, first + more, count)
    assert numbers[0] == first
    assert len(numbers) == min(count, more + 1)
    if count > 1 and more:
        assert numbers[-1] == first + more
        assert np.ptp(np.diff(numbers)) <= 1


def test_film_strip_has_frames_with_boxes_in_order(tmp_path):
    def image_of(number):
        return np.full((40, 60, 3), 10 * number, np.uint8)

    frames = [1, 5, 9, 13, 17, 21, 25]
    boxes = {"a": np.array([[4 + i, 10, 20, 20] for i in range(26)], float)}
    options = {"columns": 4, "shades": {"a": colour(2)}}
    strip = film_strip(image_of, frames, boxes, "title", **options)
    assert strip.shape[1] == pytest.approx(STRIP_WIDTH, abs=4)
    scale = (STRIP_WIDTH - 12) / 4 / 60
    tile_height = round(40 * scale)
    for position, number in enumerate(frames):
        top, left = 28 + (position // 4) * (tile_height + 4), (position % 4) * (60 * scale + 4)
        x, y = int(left + (4 + number) * scale), int(top + 20 * scale)
        assert strip[y, x + 60].tolist() == [10 * number] * 3
        assert is_colour(strip[y, x - 2 : x + 3], 2).any()
    path = tmp_path / "strip.png"
    save_png(path, strip)
    assert np.array_equal(cv2.imread(str(path)), strip)


@pytest.mark.parametrize("size", [(61, 83), (480, 640)])
def test_video_is_h264_with_all_frames_and_boxes(tmp_path, size):
    n = 12
    boxes = {"a": np.array([[10 + i, 30, 30, 25] for i in range(n)], float)}
    images = ((i, np.full((*size, 3), 128, np.uint8)) for i in range(n))
    save_video(tmp_path / "v.mp4", images, boxes, fps=12.5)
    with av.open(str(tmp_path / "v.mp4")) as video:
        stream = video.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert float(stream.average_rate) == 12.5
        decoded = [frame.to_ndarray(format="bgr24") for frame in video.decode(video=0)]
    assert len(decoded) == n
    assert decoded[0].shape[0] % 2 == decoded[0].shape[1] % 2 == 0
    scale = max(1, 480 / size[1])
    for i in (0, n - 1):
        x, y = (10 + i + 15) * scale, 30 * scale
        assert is_colour(decoded[i][int(y) - 2 : int(y) + 3, int(x)], 0, 60).any()
        assert np.abs(decoded[i][int((30 + 12) * scale), int(x)].astype(int) - 128).max() < 12


def test_video_needs_frames(tmp_path):
    with pytest.raises(OSError, match="no frames"):
        save_video(tmp_path / "v.mp4", [], {})


def test_write_line_accepts_surrogates():
    image = np.zeros((30, 200, 3), np.uint8)
    write_line(image, "caf\udce9", (5, 20))
    assert image.any()
    assert legend(["caf\udce9"], {"caf\udce9": "#ff0000"}, 200).any()
