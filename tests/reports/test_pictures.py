"""Plots, film strips and videos: that they show the data, where it belongs."""

import av
import cv2
import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reports.film_strip import evenly_spaced, film_strip, write_film_strip
from reports.overlay import TRUTH, legend, overlay
from reports.palette import colour, to_bgr
from reports.plots import (
    frame_plot,
    precision_plot,
    share_curve,
    speed_plot,
    success_plot,
    write_figure,
)
from reports.video import write_video
from reports.write import write_plots

GREY = np.full((60, 80, 3), 128, np.uint8)


def frame_table(overlaps, tracker="a", sequence="s", repetition=0):
    n = len(overlaps)
    return pd.DataFrame(
        {
            "tracker": tracker,
            "sequence": sequence,
            "repetition": repetition,
            "frame": np.arange(1, n + 1),
            "overlap": overlaps,
            "centre_error": 30.0 * (1 - np.asarray(overlaps, float)),
        }
    )


@given(st.lists(st.floats(0, 1), min_size=1, max_size=30))
def test_the_area_under_the_success_curve_is_the_mean_overlap(overlaps):
    thresholds = np.linspace(0, 1, 4001)
    curve = share_curve(frame_table(overlaps), "overlap", thresholds, at_least=True)
    assert np.trapezoid(curve, thresholds) == pytest.approx(np.mean(overlaps), abs=1e-3)
    assert curve[0] == 1.0
    assert (np.diff(curve) <= 0).all()


def test_curves_include_their_thresholds_and_count_each_sequence_once():
    table = pd.concat([frame_table([0.5, 0.7]), frame_table([0.1] * 8, sequence="t")])
    share = share_curve(table, "overlap", np.array([0.5, 0.500001]), at_least=True)
    np.testing.assert_allclose(share, [0.5, 0.25])
    share = share_curve(table, "centre_error", np.array([15.0, 14.9999]), at_least=False)
    np.testing.assert_allclose(share, [0.5, 0.25])


def test_plots_draw_a_line_a_tracker_and_name_it_with_its_figure():
    table = pd.concat([frame_table([0.25, 0.75]), frame_table([1.0, 1.0], tracker="b")])
    (axes,) = success_plot(table, "T", ["a", "b"]).axes
    assert [line.get_label() for line in axes.lines] == ["a (0.500)", "b (1.000)"]
    assert axes.lines[1].get_ydata()[-1] == 1.0
    (axes,) = precision_plot(table, "T", ["a", "b"]).axes
    assert [line.get_label() for line in axes.lines] == ["a (0.500)", "b (1.000)"]


def test_the_frame_plot_shows_the_median_over_repetitions_with_a_band():
    table = pd.concat([frame_table([o, 0.5], repetition=i) for i, o in enumerate([0.1, 0.2, 0.9])])
    upper, lower = frame_plot(table, "s", ["a"]).axes
    np.testing.assert_allclose(upper.lines[0].get_ydata(), [0.2, 0.5])
    np.testing.assert_allclose(lower.lines[0].get_ydata(), [24.0, 15.0])
    assert len(upper.collections) == 1
    assert not frame_plot(frame_table([0.1]), "s", ["a"]).axes[0].collections


def test_a_tracker_keeps_its_colour_and_an_incomplete_one_gets_no_curve():
    table = pd.concat([frame_table([0.25, 0.75]), frame_table([1.0, 1.0], tracker="b")])
    (axes,) = success_plot(table, "T", ["x", "a", "b"], incomplete={"a"}).axes
    assert [line.get_label() for line in axes.lines] == [
        "x (incomplete)",
        "a (incomplete)",
        "b (1.000)",
    ]
    assert np.isnan(axes.lines[1].get_ydata()).all()
    assert axes.lines[2].get_color() == colour(2)
    upper, _ = frame_plot(table, "s", ["x", "a", "b"]).axes
    assert [line.get_color() for line in upper.lines] == [colour(1), colour(2)]


def test_the_speed_plot_shows_no_tracker_of_which_a_pass_was_disturbed():
    timing = pd.DataFrame(
        {
            "tracker": ["a", "a", "b", "b"],
            "cpu_seconds_median": [0.001, 0.003, np.nan, 0.1],
            "cpu_seconds_p95": [0.003, 0.003, np.nan, 0.1],
        }
    )
    (axes,) = speed_plot(timing, "T").axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["a", "b"]
    assert len(axes.lines) == 2
    np.testing.assert_allclose(axes.lines[0].get_xdata(), [2.0, 3.0])


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_figures_are_written_whole_by_their_suffix(tmp_path, suffix):
    path = write_figure(
        tmp_path / "deep" / f"plot{suffix}", success_plot(frame_table([0.5]), "T", ["a"])
    )
    start = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}[suffix]
    assert path.read_bytes().startswith(start)
    assert list(path.parent.iterdir()) == [path]


def test_a_figure_has_the_same_bytes_twice(tmp_path):
    paths = [
        write_figure(tmp_path / f"{i}.png", success_plot(frame_table([0.5]), "T", ["a"]))
        for i in "ab"
    ]
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_write_plots_draws_what_the_data_allow(tmp_path):
    timing = pd.DataFrame({"tracker": ["a"], "cpu_seconds_median": [0.1], "cpu_seconds_p95": [0.2]})
    paths = write_plots(tmp_path, frame_table([0.5], sequence="x/y:z=1"), timing, "T", ["a"])
    assert [path.name for path in paths] == [
        "success.png",
        "precision.png",
        "frames-x-y-z-1.png",
        "speed.png",
    ]
    assert write_plots(tmp_path / "none", pd.DataFrame(), timing[:0], "T", ["a"]) == []


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match=r"file/p\.png can't be written"):
        write_figure(tmp_path / "file" / "p.png", success_plot(frame_table([0.5]), "T", ["a"]))


def changed(drawn):
    return np.argwhere((drawn != 128).any(axis=2))


def test_a_box_is_drawn_along_its_edges_and_nowhere_else():
    drawn = overlay(GREY, {"a": np.array([20, 10, 30, 25])}, {"a": colour(0)})
    rows, columns = changed(drawn).T
    for y, x in zip(rows, columns, strict=True):
        # Continuous distance of the pixel's centre to the nearest edge line.
        outside = max(20 - (x + 0.5), (x + 0.5) - 50, 10 - (y + 0.5), (y + 0.5) - 35, 0)
        inside = min(abs(x + 0.5 - 20), abs(x + 0.5 - 50), abs(y + 0.5 - 10), abs(y + 0.5 - 35))
        assert max(outside, 0) <= 4
        assert inside <= 4
    for y, x in ((10, 35), (34, 35), (20, 20), (20, 49)):
        assert (drawn[y, x] != 128).any()


def test_colour_and_enlargement_are_as_asked_for():
    drawn = overlay(GREY, {"a": np.array([20, 10, 30, 25])}, {"a": colour(1)}, scale=3)
    assert drawn.shape == (180, 240, 3)
    assert np.abs(drawn[30, 105].astype(int) - to_bgr(colour(1))).max() < 40


def test_the_truth_is_white_and_dashed():
    drawn = overlay(GREY, {TRUTH: np.array([10, 10, 60, 40.0])}, {}, scale=4)
    top = drawn[38:42, 44:276].max(axis=(0, 2))
    assert top.max() > 200
    assert top.min() == 128


def test_boxes_that_are_absent_or_far_outside_are_no_trouble():
    boxes = {"a": np.full(4, np.nan), "b": np.array([-1e9, -1e9, 1e12, 5])}
    drawn = overlay(GREY, boxes, {"a": colour(0), "b": colour(1)})
    assert drawn.shape == GREY.shape
    assert np.array_equal(overlay(GREY, {"a": np.full(4, np.nan)}, {"a": colour(0)}), GREY)


def test_the_image_that_is_drawn_on_is_a_copy():
    before = GREY.copy()
    overlay(GREY, {"a": np.array([1, 1, 9, 9])}, {"a": colour(0)}, words="7")
    assert np.array_equal(GREY, before)


def test_a_long_legend_wraps():
    labels = {f"tracker-with-a-long-name-{i}": colour(i) for i in range(6)}
    assert legend(labels, 2000).shape[0] < legend(labels, 400).shape[0]
    assert legend(labels, 400).shape[1] == 400


@given(st.integers(0, 50), st.integers(0, 500), st.integers(1, 40))
def test_frames_are_spaced_evenly_from_the_first_to_the_last(first, more, count):
    numbers = evenly_spaced(first, first + more, count)
    assert numbers[0] == first
    assert len(numbers) == min(count, more + 1)
    if count > 1 and more:
        assert numbers[-1] == first + more
        assert np.ptp(np.diff(numbers)) <= 1


def test_a_strip_shows_the_frames_asked_for_in_order(tmp_path):
    def image_of(number):
        return np.full((40, 60, 3), 10 * number, np.uint8)

    asked = [1, 5, 9, 13, 17, 21, 25]
    strip = film_strip(image_of, asked, {}, "title", columns=4, width=800)
    assert strip.shape[1] == pytest.approx(800, abs=4)
    tile_height = round(40 * (800 - 12) / 4 / 60)
    for position, number in enumerate(asked):
        y = 28 + (position // 4) * (tile_height + 4) + tile_height // 2
        x = (position % 4) * 201 + 100
        assert strip[y, x].tolist() == [10 * number] * 3
    path = write_film_strip(tmp_path / "strip.png", strip)
    assert np.array_equal(cv2.imread(str(path)), strip)


@pytest.mark.parametrize("size", [(60, 80), (61, 83), (480, 640)])
def test_a_video_is_h264_with_every_frame_and_its_boxes(tmp_path, size):
    n = 12
    boxes = {"a": np.array([[10 + i, 10, 30, 25] for i in range(n)], float)}
    images = ((i, np.full((*size, 3), 128, np.uint8)) for i in range(n))
    path = write_video(tmp_path / "v.mp4", images, boxes, fps=12.5)
    with av.open(str(path)) as video:
        stream = video.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert float(stream.average_rate) == 12.5
        decoded = [frame.to_ndarray(format="bgr24") for frame in video.decode(video=0)]
    assert len(decoded) == n
    assert decoded[0].shape[0] % 2 == decoded[0].shape[1] % 2 == 0
    scale = max(1, 480 / size[1])
    for i in (0, n - 1):
        x, y = (10 + i + 15) * scale, 10 * scale
        patch = decoded[i][int(y) - 2 : int(y) + 3, int(x)].astype(int)
        assert np.abs(patch - to_bgr(colour(0))).sum(axis=1).min() < 90
        assert np.abs(decoded[i][int((10 + 12) * scale), int(x)].astype(int) - 128).max() < 12


def test_a_video_without_frames_is_an_error_and_leaves_nothing(tmp_path):
    with pytest.raises(OSError, match="no frames"):
        write_video(tmp_path / "v.mp4", [], {})
    assert list(tmp_path.iterdir()) == []
