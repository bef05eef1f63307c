"""Pictures from stored runs on short scenes: that they show these, and only what was asked for."""

import cv2
import numpy as np
import pandas as pd
import pytest

import datasets
from bench.evaluation.loop import run_in_lock_step
from bench.experiments.contestant import contestant
from bench.experiments.experiment import read_experiment
from bench.metrics.centre_error import centre_error
from bench.papers import drawing
from bench.papers.drawing import undrawn
from bench.papers.stored import StoredRuns
from bench.papers.wang2010 import curves, figures, methods, strips
from bench.papers.wang2010 import scores as scoring
from bench.papers.wang2010.curves import (
    error_plots,
    over_scenes,
    particle_plot,
    sample_size_plot,
    time_plot,
)
from bench.papers.wang2010.figures import NUMBERS, draw
from bench.papers.wang2010.methods import EXPERIMENTS, PRESETS, every_method
from bench.papers.wang2010.plain import colour_map, make_template
from bench.papers.wang2010.strips import film_strips
from bench.statistics.intervals import wilson_interval
from bench.store.asked import Asked
from bench.store.results import Results
from bench.store.truth import write_truth
from reports.overlay import TRUTH

pytestmark = pytest.mark.slow

BALL, HAND, CUP = (f"plain/target:length={length}" for length in (60, 61, 62))
REAL = list(EXPERIMENTS)
SHORT = dict(zip((BALL, HAND, CUP), EXPERIMENTS.values(), strict=True))
PROPOSED = "wang2010:preset=as-written"


@pytest.fixture(scope="module", autouse=True)
def short_scenes():
    with pytest.MonkeyPatch.context() as patch:
        for module in (methods, curves):
            patch.setattr(module, "TABLE_TENNIS", BALL)
            patch.setattr(module, "HAND", HAND)
            patch.setattr(module, "CUP", CUP)
        for module in (figures, scoring):
            patch.setattr(module, "TABLE_TENNIS", BALL)
        for module in (methods, curves, strips):
            patch.setattr(module, "EXPERIMENTS", SHORT)
        real = dict(zip(REAL, SHORT, strict=True))
        frames = {real[name]: numbers for name, numbers in strips.FRAMES.items()}
        patch.setattr(strips, "FRAMES", frames)
        drawn = {key: (real[name], preset) for key, (name, preset) in strips.STRIPS.items()}
        patch.setattr(strips, "STRIPS", drawn)
        patch.setattr(curves, "ERRORS", {key: real[name] for key, name in curves.ERRORS.items()})
        yield


@pytest.fixture(scope="module")
def results(short_scenes, tmp_path_factory):
    """Both presets of everything; of the first sequence two scenes, and two repetitions of one."""
    root = tmp_path_factory.mktemp("results")
    for name, experiment in SHORT.items():
        stored, versions = Results(root / experiment), {}
        texts = {text for preset in PRESETS for text in every_method(name, preset).values()}
        texts |= {f"{PROPOSED}:particles=15"} if name == CUP else {PROPOSED}
        entries = [(contestant(text), 0) for text in sorted(texts)]
        if name == BALL:
            entries.append((contestant(PROPOSED), 1))
        for text in (name, f"{name}:scene=1") if name == BALL else (name,):
            sequence = datasets.load(text)
            write_truth(stored.folder, sequence)
            for run in run_in_lock_step(entries, sequence).runs:
                assert stored.write(run)
                key = run.identity
                cell = key.tracker, key.sequence, key.repetition, key.protocol
                versions[cell] = key.version
        stored.prepare(Asked(experiment, versions))
    return root


@pytest.fixture
def asked(results):
    return {folder.name: set(Results(folder).asked().cells) for folder in results.iterdir()}


@pytest.fixture
def stored(results, asked):
    return StoredRuns(results, asked)


@pytest.fixture
def scores():
    """Runs whose success is known: 1 of 4 of one scene and all of another succeed with 60."""
    rows = [
        {
            "tracker": tracker,
            "reach": reach,
            "radius": "rule",
            "particles": number,
            "scene": scene,
            "success": value,
        }
        for tracker, reach in (("wang2010", "any"), ("particle-filter", "rule"))
        for number in (60, 400)
        for scene, successes in ((0, [1, 0, 0, 0]), (1, [1, 1]))
        for value in (successes if number == 60 else [1.0])
    ]
    return pd.DataFrame(rows).assign(
        sequence=BALL, model="fused", preset="as-written", variant="", budget="other"
    )


@pytest.fixture
def tables():
    rows = [
        {"method": method, "implementation": name, "particles": number, "seconds": seconds}
        for method in ("proposed", "particle_filter")
        for name in ("plain", "compiled")
        for number in (60, 400)
        for seconds in (1e-3, 2e-3, 5e-3)
    ]
    return {"particle_times": pd.DataFrame(rows)}


@pytest.fixture
def unwritten(monkeypatch):
    """Pictures are made, but not rendered: that takes longest."""
    for writer in ("write_figure", "write_film_strip"):
        monkeypatch.setattr(drawing, writer, lambda path, _: path)


def test_pictures_come_in_the_papers_order(results, asked, tables, scores, tmp_path, unwritten):
    paths = draw(results, tmp_path / "new", asked, tables, scores)
    assert [path.stem for path in paths] == [
        *("figure-1", "figure-3", "figure-3-recommended", "figure-4"),
        *("figure-5", "figure-5-errors"),
        *("figure-6", "figure-6-errors", "figure-6-recommended"),
        *("particles", "particles-time", "sample-size"),
    ]
    assert undrawn(paths, NUMBERS) == []


def test_every_picture_is_drawn_whole(results, asked, tables, scores, tmp_path):
    for path in draw(results, tmp_path / "new", asked, tables, scores):
        assert min(cv2.imread(str(path)).shape[:2]) > 250


def test_pictures_without_runs_are_left_out(results, asked, tables, scores, tmp_path, unwritten):
    paths = draw(results, tmp_path, {}, tables, scores[:0])
    assert [path.stem for path in paths] == ["figure-1", "particles-time"]
    assert undrawn(paths, NUMBERS) == ["Not drawn, for want of finished runs: Fig. 3, 4, 5, 6."]


def test_the_maps_are_those_of_the_papers_frame():
    panels = figures._maps(BALL).axes
    assert [axes.get_title() for axes in panels][:2] == ["frame 11", "frame 12"]
    sequence = datasets.load(BALL)
    shown = [np.asarray(axes.images[0].get_array()) for axes in panels]
    assert np.array_equal(shown[0], sequence[10][..., ::-1])
    assert np.array_equal(shown[1], sequence[11][..., ::-1])
    colour = colour_map(sequence[11], make_template(sequence[0], sequence.boxes[0]))
    assert np.array_equal(shown[3], colour)
    assert np.array_equal(shown[4], np.where(shown[2] > 0, colour, 0))
    assert shown[5] == pytest.approx(np.where(shown[2] > 0, colour, 0.2 * colour))
    assert 0 < shown[2].mean() < 0.5
    assert panels[5].patches[0].get_xy() == tuple(sequence.boxes[11][:2])


def test_strips_have_the_papers_frames_and_a_row_a_method(stored, monkeypatch):
    rows = []

    def strip(image_of, numbers, boxes, title, columns, width, *, shades, words, count_from):
        rows.append((numbers, list(boxes), title, words, count_from))
        return np.zeros((10, 20, 3), np.uint8)

    monkeypatch.setattr(strips, "film_strip", strip)
    found = film_strips(stored)
    assert {name: len(picture) // 10 for name, picture in found.items()} == {
        "figure-3": 5,
        "figure-3-recommended": 5,
        "figure-5": 5,
        "figure-6": 6,
        "figure-6-recommended": 6,
    }
    numbers, labels, title, words, count_from = rows[0]
    assert [number + count_from for number in numbers] == [10, 11, 12, 16]
    assert labels == [TRUTH, "proposed, N = 60"]
    assert "Fig. 3, as written" in title
    assert [row[2] for row in rows[1:5]] == [""] * 4
    (run, _) = stored.of(SHORT[BALL], BALL, PROPOSED)
    error = centre_error(datasets.load(BALL).boxes, run.boxes)[11]
    assert words[11] == f"({error:.1f} px)"
    assert [rows[row][1][1] for row in (10, 13, 14, 15)] == [
        "improved CamShift",
        "proposed, N = 60",
        "particle filter, N = 400",
        "proposed, N = 15",
    ]


def test_numbers_over_scenes_are_means_over_repetitions(stored):
    rows = over_scenes(stored, BALL, {"a": PROPOSED, "b": "camshift"}, curves._error)
    assert rows.groupby(["label", "repetition"]).size().tolist() == [60] * 4
    for scene, name in enumerate((BALL, f"{BALL}:scene=1")):
        truth = datasets.load(name).boxes
        errors = [centre_error(truth, run.boxes) for run in stored.of(SHORT[BALL], name, PROPOSED)]
        assert len(errors) == 2
        here = rows[(rows["label"] == "a") & (rows["repetition"] == scene)]
        assert here["frame"].tolist() == list(range(1, 61))
        np.testing.assert_allclose(here["value"], np.mean(errors, axis=0))


def test_errors_are_drawn_as_written_beside_what_is_recommended(stored):
    plots = error_plots(stored)
    titles = {name: [axes.get_title() for axes in plot.axes] for name, plot in plots.items()}
    assert titles == {
        "figure-4": ["as written", "recommended"],
        "figure-5-errors": ["as written"],
        "figure-6-errors": ["as written", "recommended"],
    }
    written, recommended = plots["figure-4"].axes
    assert len(written.lines) == len(recommended.lines) == 4
    rows = over_scenes(stored, BALL, {"a": PROPOSED}, curves._error)
    np.testing.assert_allclose(
        written.lines[0].get_ydata(), rows.groupby("frame")["value"].median()
    )
    assert written.lines[0].get_ydata().tolist() != recommended.lines[0].get_ydata().tolist()
    assert written.lines[2].get_ydata().tolist() == recommended.lines[2].get_ydata().tolist()


def test_sample_sizes_are_of_both_filters_on_every_sequence(stored):
    plot = sample_size_plot(stored)
    assert len(plot.axes) == 6
    written = [[line.get_ydata() for line in axes.lines] for axes in plot.axes[:3]]
    assert [len(lines) for lines in written] == [2, 2, 2]
    (first, second) = stored.of(SHORT[BALL], BALL, PROPOSED)
    size = np.mean([run.details["effective_sample_size"] for run in (first, second)], axis=0)
    other = stored.of(SHORT[BALL], f"{BALL}:scene=1", PROPOSED)
    other_size = np.mean([run.details["effective_sample_size"] for run in other], axis=0)
    np.testing.assert_allclose(written[0][0], (size + other_size) / 2)  # none in the first frame


def test_success_is_the_mean_over_scenes_with_an_interval_over_them(scores):
    (axes,) = particle_plot(scores).axes
    line = axes.containers[0][0]
    assert line.get_xdata().tolist() == [60, 400]
    assert line.get_ydata().tolist() == [0.625, 1.0]
    (bars,) = axes.containers[0][2]
    assert bars.get_segments()[0][:, 1] == pytest.approx(tuple(wilson_interval(0.625, 2)))
    assert particle_plot(scores.assign(model="hue")) is None
    assert particle_plot(scores[scores["particles"] == 60]) is None  # one number is no curve
    several = pd.concat([scores, scores.assign(radius="10")])
    labels = [text.get_text() for text in particle_plot(several).legends[0].get_texts()]
    assert labels[:4] == [
        "proposed",
        "proposed, r = 10",
        "particle filter",
        "particle filter, r = 10",
    ]
    chosen = scores.assign(variant="sigma=0.2")
    both = particle_plot(pd.concat([scores, chosen]))
    assert [axes.get_title() for axes in both.axes] == ["as written, σ = 1", "σ = 0.2 (post hoc)"]


def test_times_are_medians_over_passes(tables):
    assert time_plot(tables["particle_times"].iloc[:0]) is None
    plain, compiled = time_plot(tables["particle_times"]).axes
    assert [axes.get_title() for axes in (plain, compiled)] == ["plain", "compiled"]
    for axes in (plain, compiled):
        for container in axes.containers:
            assert container[0].get_ydata().tolist() == [2.0, 2.0]
            assert container[2][0].get_segments()[0][:, 1] == pytest.approx([1.0, 5.0])


def test_what_figures_compare_is_what_the_experiments_run():
    for name, short in zip(REAL, SHORT, strict=True):
        run = {contestant(text).label for text in read_experiment(EXPERIMENTS[name]).trackers}
        for preset in PRESETS:
            for text in every_method(short, preset).values():
                assert contestant(text).label in run
