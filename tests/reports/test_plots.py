"""Plots: that their lines are the data, and that everything is inside the picture."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trackmark.reports.figures import fold, write_figure
from trackmark.reports.palette import colour
from trackmark.reports.plots import (
    curve_plot,
    frame_plot,
    precision_plot,
    share_curve,
    speed_plot,
    success_plot,
)
from trackmark.reports.printable import printable
from trackmark.reports.write import file_names, write_plots

LONG = "multipart:preset=robust:particles=400:half_width=3.5:resampling=systematic"


def frame_table(overlaps, tracker="a", sequence="s", repetition=0, revised=False):
    n = len(overlaps)
    return pd.DataFrame(
        {
            "tracker": tracker,
            "sequence": sequence,
            "repetition": repetition,
            "frame": np.arange(1, n + 1),
            "overlap": overlaps,
            "centre_error": 30.0 * (1 - np.asarray(overlaps, float)),
            "revised": revised,
        }
    )


def timing(trackers, median, tail):
    return pd.DataFrame(
        {"tracker": trackers, "cpu_seconds_median": median, "cpu_seconds_p95": tail}
    )


def labels_of(figure):
    return [line.get_label() for line in figure.axes[0].lines]


def words(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


@pytest.mark.parametrize("name", ["a$\\frac{$", "$a$ and $b$", "_mine.py:Mine", "\x1b[2J"])
def test_a_name_is_no_formula_and_stands_in_the_legend(name, tmp_path):
    table = frame_table([0.5], tracker=name, sequence=name)
    for figure in (success_plot(table, name, [name]), frame_plot(table, name, [name])):
        assert write_figure(tmp_path / "plot.png", figure).stat().st_size
        (shown,) = words(figure)
        assert shown.replace("\\$", "$").strip().startswith(printable(name))


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
    for plot in (success_plot, precision_plot):
        figure = plot(table, "T", ["a", "b"])
        assert labels_of(figure) == ["a (0.500)", "b (1.000)"]
        assert figure.axes[0].lines[1].get_ydata()[-1] == 1.0


def test_the_frame_plot_shows_the_median_over_repetitions_with_a_band():
    table = pd.concat([frame_table([o, 0.5], repetition=i) for i, o in enumerate([0.1, 0.2, 0.9])])
    upper, lower = frame_plot(table, "s", ["a"]).axes
    np.testing.assert_allclose(upper.lines[0].get_ydata(), [0.2, 0.5])
    np.testing.assert_allclose(lower.lines[0].get_ydata(), [24.0, 15.0])
    assert len(upper.collections) == 1
    assert not frame_plot(frame_table([0.1]), "s", ["a"]).axes[0].collections


def test_a_tracker_keeps_its_colour_and_an_incomplete_one_gets_no_curve():
    table = pd.concat([frame_table([0.25, 0.75]), frame_table([1.0, 1.0], tracker="b")])
    figure = success_plot(table, "T", ["x", "a", "b"], incomplete={"a"})
    (axes,) = figure.axes
    assert labels_of(figure) == ["x (incomplete)", "a (incomplete)", "b (1.000)"]
    assert np.isnan(axes.lines[1].get_ydata()).all()
    assert axes.lines[2].get_color() == colour(2)
    upper, _ = frame_plot(table, "s", ["x", "a", "b"]).axes
    assert [line.get_color() for line in upper.lines] == [colour(1), colour(2)]


def test_the_speed_plot_shows_no_tracker_of_which_a_pass_was_disturbed():
    passes = timing([*"aabb"], [0.001, 0.003, np.nan, 0.1], [0.003, 0.003, np.nan, 0.1])
    (axes,) = speed_plot(passes, "T", ["x", "a", "b"]).axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["a", "b"]
    assert len(axes.lines) == 2
    np.testing.assert_allclose(axes.lines[0].get_xdata(), [2.0, 3.0])
    assert axes.lines[0].get_color() == colour(1)
    (word,) = [text for text in axes.texts if text.get_text() == "disturbed or failed"]
    assert word.get_position()[1] == 1


def test_a_frame_without_a_value_is_a_miss_at_every_threshold():
    table = frame_table([0.5, np.nan])
    share = share_curve(table, "overlap", np.array([0.0, 0.5, 1.0]), at_least=True)
    np.testing.assert_allclose(share, [0.5, 0.5, 0.0])
    share = share_curve(table, "centre_error", np.array([0.0, 15.0, 50.0]), at_least=False)
    np.testing.assert_allclose(share, [0.0, 0.5, 0.5])
    assert labels_of(success_plot(table, "T", ["a"])) == ["a (0.250)"]


def test_the_frame_plot_says_how_many_runs_a_median_is_over():
    table = pd.concat(
        [frame_table([0.5], repetition=i, tracker="a") for i in (0, 2)]
        + [frame_table([0.5], tracker="b"), frame_table([0.5], tracker="c")]
    )
    figure = frame_plot(table, "s", ["a", "b", "c", "d", "e"], incomplete={"c", "d"})
    assert words(figure) == ["a (2 runs)", "b", "c (1 run)", "d (0 runs)"]


def test_headlines_say_that_boxes_are_online_where_a_tracker_revised_some():
    def headlines(table):
        figures = [plot(table, "T", ["a", "b"]) for plot in (success_plot, precision_plot)]
        figures += [frame_plot(table, sequence, ["a", "b"]) for sequence in "st"]
        return [figure.get_suptitle() for figure in figures]

    plain = [frame_table([0.5]), frame_table([0.5], sequence="t")]
    assert headlines(pd.concat(plain)) == ["T", "T", "s", "t"]
    beside = frame_table([0.5], tracker="b", sequence="t", revised=True)
    words = ", said at once (online)"
    assert headlines(pd.concat([*plain, beside])) == [f"T{words}", f"T{words}", "s", f"t{words}"]


@pytest.mark.parametrize("labels", [["a", LONG], [f"{LONG}:seed={i}" for i in range(12)]])
def test_labels_however_long_are_inside_the_picture_and_leave_the_data_room(labels):
    title = "a headline of some length over a sequence: " + LONG
    table = pd.concat([frame_table([0.2, 0.7], label, title) for label in labels])
    figures = [plot(table, title, labels) for plot in (success_plot, precision_plot, frame_plot)]
    for figure in [*figures, speed_plot(timing(labels, 0.001, 0.003), title, labels)]:
        figure.draw_without_rendering()
        width, height = figure.bbox.size
        for axes in figure.axes:
            assert axes.bbox.width > (0.5 if len(figure.axes) <= 2 else 0.25) * width
            assert axes.bbox.height > 100
            for legend in figure.legends:
                assert not legend.get_window_extent().overlaps(axes.bbox)
        for artist in (*figure.axes, *figure.legends, *figure.texts):
            drawn = artist.get_tightbbox()
            assert min(drawn.x0, drawn.y0) >= -1
            assert drawn.x1 <= width + 1
            assert drawn.y1 <= height + 1


def test_a_legend_has_as_many_columns_as_there_is_room_for():
    def lines(label):
        labels = [f"{label}{i}" for i in range(4)]
        table = pd.concat([frame_table([0.5], tracker=label) for label in labels])
        figure = success_plot(table, "T", labels)
        figure.draw_without_rendering()
        texts = figure.legends[0].get_texts()
        return len({round(text.get_window_extent().y0) for text in texts})

    assert [lines("a"), lines("a" * 32), lines(LONG)] == [1, 2, 4]


@given(st.text("ab:/ ", max_size=60), st.integers(1, 30))
def test_folding_loses_nothing_but_spaces_at_line_ends(text, width):
    folded = fold(text, width)
    assert folded.replace("\n", "").replace(" ", "") == text.replace(" ", "")
    for line in folded.split("\n"):
        assert len(line) <= width or not any(sign in line.rstrip(":/ ") for sign in ":/ ")


@pytest.mark.parametrize(
    ("suffix", "start"), [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")]
)
def test_figures_are_written_whole_by_their_suffix_with_the_same_bytes(tmp_path, suffix, start):
    first, second = (
        write_figure(tmp_path / i / f"p{suffix}", success_plot(frame_table([0.5]), "T", ["a"]))
        for i in "ab"
    )
    assert first.read_bytes().startswith(start)
    assert first.read_bytes() == second.read_bytes()
    assert list(first.parent.iterdir()) == [first]


@settings(max_examples=30)
@given(st.lists(st.text(min_size=1) | st.text("aA-|/", min_size=1), unique=True, max_size=6))
def test_different_labels_get_different_names_of_files(labels):
    names = file_names([*labels, *(label * 80 for label in labels[:1])])
    assert len({name.casefold() for name in names.values()}) == len(names)
    for name in names.values():
        assert "/" not in name
        assert len(f"frames-{name}.png".encode()) < 255
    assert file_names(["samples/face"]) == {"samples/face": "samples-face"}


def test_write_plots_draws_what_the_data_allow(tmp_path):
    passes = timing(["a"], 0.1, 0.2)
    paths = write_plots(tmp_path, frame_table([0.5], sequence="x/y:z=1"), passes, "T", ["a"])
    names = ["success", "precision", "frames-x-y-z-1", "speed"]
    assert paths == [tmp_path / f"{name}.png" for name in names]
    assert write_plots(tmp_path / "none", pd.DataFrame(), passes[:0], "T", ["a"]) == []


def test_a_report_keeps_colours_and_counts_runs_in_every_plot(tmp_path, monkeypatch):
    drawn = {}
    monkeypatch.setattr(
        "trackmark.reports.figures.write_figure", lambda path, fig: drawn.setdefault(path, fig)
    )
    table = pd.concat([frame_table([0.5], tracker="b"), frame_table([0.5], tracker="c")])
    passes = timing(["t", "c"], 0.1, 0.2)
    write_plots(tmp_path, table, passes, "T", ["a", "b", "c"], incomplete={"a", "b"})
    figures = {path.stem: figure for path, figure in drawn.items()}
    assert words(figures["frames-s"]) == ["a (0 runs)", "b (1 run)", "c"]
    dots = figures["speed"].axes[0].lines[::2]
    assert [line.get_color() for line in dots] == [colour(2), colour(3)]


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match=r"cannot write \(Not a directory\): .*file/p\.png"):
        write_figure(tmp_path / "file" / "p.png", success_plot(frame_table([0.5]), "T", ["a"]))


@pytest.mark.parametrize(("n", "panels"), [(7, 1), (8, 9)])
def test_more_than_seven_lines_have_a_panel_each_and_keep_their_style(n, panels):
    labels = [f"t{number}" for number in range(n)]
    points = {
        label: np.array([[0.0, 0.5], [1.0, number / n]]) for number, label in enumerate(labels)
    }
    figure = curve_plot(points, "x", "y", "title", labels)
    assert len(figure.axes) == panels
    if panels > 1:
        for number, axes in enumerate(figure.axes[:n]):
            line = axes.get_lines()[-1]
            assert axes.get_title() == labels[number]
            assert line.get_color() == colour(number)
            assert line.get_ydata()[-1] == number / n
            assert len(axes.get_lines()) == n + 1  # the others are grey behind it
        figure.draw_without_rendering()


def test_frames_of_more_than_seven_trackers_have_a_row_each():
    labels = [f"t{number}" for number in range(8)]
    table = pd.concat(
        [
            frame_table([number / 8, 1.0], label, repetition=repetition)
            for number, label in enumerate(labels)
            for repetition in range(2)
        ]
    )
    figure = frame_plot(table, "s", labels)
    assert len(figure.axes) == 16
    for number, left in enumerate(figure.axes[::2]):
        *others, line = left.get_lines()
        assert left.get_title(loc="left") == f"t{number} (2 runs)"
        assert (line.get_color(), line.get_ydata()[0]) == (colour(number), number / 8)
        assert len(others) == 8
        assert len(left.collections) == 1  # its quartiles alone
    assert len(frame_plot(table, "s", labels[:7]).axes) == 2


@pytest.mark.parametrize("n", [7, 8])
def test_a_dot_is_seen_also_where_lines_are_marked_here_and_there(n):
    labels = [f"t{number}" for number in range(n)]
    place = np.array([[0.5, 0.5]])
    for number, label in enumerate(labels):
        figure = curve_plot({label: place}, "x", "y", "T", labels)
        figure.draw_without_rendering()
        axes = figure.axes[number if n == 8 else 0]
        axes.set_axis_off()
        (line,) = [one for one in axes.get_lines() if one.get_color() == colour(number)][-1:]
        line.set_visible(False)
        without = np.asarray(figure.canvas.buffer_rgba()).copy()
        line.set_visible(True)
        figure.canvas.draw()
        assert (np.asarray(figure.canvas.buffer_rgba()) != without).any()
