"""Figures of a tiny paper: film strips, series and a hook of its own."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from trackmark import datasets
from trackmark.bench.papers import figures
from trackmark.bench.papers.figures import draw_figures, figure_label
from trackmark.bench.papers.runs import Context

SCENES = [f"plain/target:length=20:scene={number}" for number in (200, *range(202, 213))]
ADAPTIVE = "camshift:window=adaptive"


@pytest.fixture
def redraw(report, tmp_path):
    """`redraw(NAME=updates)` draws the figures again, the named entry with other fields."""

    def redraw(name, **updates):
        tiny_paper = report.context.description
        figure = {name: tiny_paper.figure[name].model_copy(update=updates)}
        description = tiny_paper.model_copy(update={"figure": figure})
        return draw_figures(replace(report.context, description=description, folder=tmp_path))

    return redraw


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("figure-3", "Fig. 3"),
        ("figure-1a", "Fig. 1a"),
        ("figure-5-as-written", "Fig. 5, as written"),
        ("particle-times", "Particle times"),
    ],
)
def test_label_is_the_papers_name(name, label):
    assert figure_label(name) == label


def test_figures_are_drawn_in_order_of_the_entries(report):
    names = ["figure-1", "figure-2", "figure-10", "figure-10-later"]
    assert [drawing.name for drawing in report.figures] == names
    for drawing in report.figures:
        assert cv2.imread(str(drawing.path)) is not None
    assert report.figures[0].caption == "Frames 1, 10 and 20 with both trackers."


def test_quick_report_has_strips_and_quick_hooks(tiny):
    names = [drawing.name for drawing in tiny.report(quick=True).figures]
    assert names == ["figure-1", "figure-10", "figure-10-later"]


def test_strip_shows_the_scene_of_median_error(report):
    errors = {
        scene: report.context.runs.judged_runs(ADAPTIVE, scene)[0].error.mean() for scene in SCENES
    }
    middle = sorted(errors, key=errors.__getitem__)[5]  # the lower one of twelve
    assert f"Frames 1, 10, 20 of {middle}, the scene" in report.figures[0].words


def test_strip_has_a_row_per_tracker_and_setting(report, redraw, monkeypatch):
    titles, numbering = [], []
    draw = figures.film_strip

    def film_strip(image_of, numbers, boxes, title, *arguments, **options):
        titles.append(title)
        numbering.append((numbers, options["count_from"]))
        return draw(image_of, numbers, boxes, title, *arguments, **options)

    monkeypatch.setattr(figures, "film_strip", film_strip)
    redraw("figure-1")
    assert [title.partition(":")[0] for title in titles] == [
        "camshift, as written", "camshift, recommended", "static, both settings",
    ]  # fmt: skip
    assert numbering == [([0, 9, 19], 1)] * 3
    assert titles[0].endswith("the same frames tracked in 12 of 12 scenes")
    judged_runs = [report.context.runs.judged_runs(ADAPTIVE, scene)[0] for scene in SCENES]
    patterns = [tuple(judged.on_target[[0, 9, 19]].tolist()) for judged in judged_runs]
    scene = report.figures[0].words.split(" of ")[1].partition(",")[0]
    same = patterns.count(patterns[SCENES.index(scene)])
    assert titles[1].endswith(f"the same frames tracked in {same} of 12 scenes")


def test_strip_of_few_frames_does_not_enlarge_them(redraw):
    (drawing,) = redraw("figure-1", frames=(1,))
    assert cv2.imread(str(drawing.path)).shape[1] <= figures.TILE_WIDTH


def test_series_has_scenes_in_a_panel_per_setting(report, redraw, monkeypatch):
    panels, draw = [], figures.series_plot
    monkeypatch.setattr(figures, "series_plot", lambda *a: panels.append(a[0]) or draw(*a))
    (drawing,) = redraw("figure-2", of="overlap", quantity="overlap [share]")
    assert "overlap [share]: median and quartiles over 12 scenes of target" in drawing.words
    (panel,) = panels
    assert list(panel) == ["as written", "recommended"]
    expected = [report.context.runs.judged_runs(ADAPTIVE, scene)[0].overlap for scene in SCENES]
    np.testing.assert_allclose(panel["recommended"]["camshift"], expected)


def test_hook_gives_several_images(report):
    sequence = datasets.load(SCENES[0])
    captions = ["Two frames.", "The later frame."]
    assert [drawing.caption for drawing in report.figures[2:]] == captions
    for drawing, frame in zip(report.figures[2:], (0, 9), strict=True):
        np.testing.assert_array_equal(cv2.imread(str(drawing.path)), sequence[frame])
        assert drawing.words == "Frames 1 and 10 of scene 200."


def test_hook_without_a_figure_is_left_out(redraw, monkeypatch):
    monkeypatch.setattr(Context, "function", lambda *_: lambda _: None)
    assert redraw("figure-10") == []
