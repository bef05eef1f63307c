"""Pictures from stored runs on a short scene: that they show these, and only what was asked for."""

import cv2
import numpy as np
import pandas as pd
import pytest

import datasets
from bench.evaluation.loop import run_in_lock_step
from bench.experiments.contestant import contestant
from bench.experiments.experiment import read_experiment
from bench.metrics.overlap import overlap
from bench.papers import drawing
from bench.papers.drawing import undrawn
from bench.papers.nguyen2002 import figures
from bench.papers.nguyen2002.figures import (
    EXPERIMENT,
    FEATURES,
    NUMBERS,
    PRESETS,
    Pictures,
    chosen_frames,
    draw,
    loss_plot,
    roc_points,
    sign_plot,
)
from bench.papers.nguyen2002.scores import labels_of
from bench.papers.stored import StoredRuns
from bench.store.asked import Asked
from bench.store.results import Results
from bench.store.truth import StoredTruth, write_truth
from reports.overlay import TRUTH

pytestmark = pytest.mark.slow

NAME = "plain/target:length=60:occlusion=1"
TEXTS = [
    f"nguyen2002:preset={preset}:features={features}"
    for preset in PRESETS.values()
    for features in FEATURES.values()
]


@pytest.fixture(scope="module", autouse=True)
def short_scene():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "RECORDING", NAME)
        yield


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    root = tmp_path_factory.mktemp("results")
    stored, versions = Results(root / EXPERIMENT), {}
    sequence = datasets.load(NAME)
    sequence.attributes["lamp off"] = np.isin(np.arange(60), range(30, 45))
    write_truth(stored.folder, sequence)
    for run in run_in_lock_step([(contestant(text), 0) for text in TEXTS], sequence).runs:
        assert stored.write(run)
        key = run.identity
        versions[key.tracker, key.sequence, key.repetition, key.protocol] = key.version
    stored.prepare(Asked(EXPERIMENT, versions))
    return root


@pytest.fixture
def asked(results):
    return {EXPERIMENT: set(Results(results / EXPERIMENT).asked().cells)}


@pytest.fixture
def pictures(results, asked):
    return Pictures(StoredRuns(results, asked))


@pytest.fixture
def scores():
    """One of two scenes is lost in frame 20 by RGB as written, in the end; nothing else is."""
    return pd.DataFrame(
        labels_of(text)
        | {
            "trace": trace,
            "sequence": NAME,
            "scene": scene,
            "frames": 60,
            "first_loss": 20.0
            if (scene, trace) == (1, "revised") and "written:features=rgb" in text
            else 60.0,
        }
        for text in TEXTS
        for trace in ("revised", "online")
        for scene in (0, 1)
    )


@pytest.fixture
def tables():
    """By RGB outliers tell all, by the invariants nothing."""
    hidden = [0.0, 0.0, 0.0, 1.0]
    frames = {"rgb": [0.1, 0.2, 0.3, 0.9], "invariants": [0.5] * 4}
    return {
        "ng-15": pd.concat(
            pd.DataFrame({"features": features, "hidden": hidden, "outliers": shares})
            for features, shares in frames.items()
        )
    }


@pytest.fixture
def unwritten(monkeypatch):
    """Pictures are made, but not rendered: that takes longest."""
    for writer in ("write_figure", "write_film_strip"):
        monkeypatch.setattr(drawing, writer, lambda path, _: path)


def test_the_papers_figure_comes_first(results, asked, tables, scores, tmp_path, unwritten):
    paths = draw(results, tmp_path / "new", asked, tables, scores)
    assert [path.stem for path in paths] == [
        *("figure-1", "figure-1-recommended", "lights-losses", "lights-outliers"),
        *("lights-overlap", "outliers-as-sign"),
    ]
    assert undrawn(paths, NUMBERS) == []


def test_every_picture_is_drawn_whole(results, asked, tables, scores, tmp_path):
    for path in draw(results, tmp_path / "new", asked, tables, scores):
        assert min(cv2.imread(str(path)).shape[:2]) > 250


def test_pictures_without_runs_are_left_out(results, scores, tmp_path, unwritten):
    assert draw(results, tmp_path, {}, {}, scores[:0]) == []
    assert undrawn([], NUMBERS) == ["Not drawn, for want of finished runs: Fig. 1."]


def test_the_strip_shows_an_occlusion_and_both_switches_of_the_lamp():
    visibility = np.ones(90)
    visibility[20:31] = [0.5, *[0.0] * 9, 0.5]
    off = np.isin(np.arange(90), range(50, 85))
    truth = StoredTruth("t", np.ones((90, 4)), {}, visibility, {"lamp off": off}, 25.0)
    assert chosen_frames(truth) == {
        17: "a) before",
        25: "b) hidden",
        40: "c) after",
        60: "d) lamp off",
        89: "lamp on again",
    }


def test_strips_have_a_row_for_each_kind_of_features_with_what_is_said_at_once_and_in_the_end(
    pictures, monkeypatch
):
    rows = []

    def strip(image_of, numbers, boxes, title, columns, *, words):
        rows.append((numbers, boxes, title, words))
        return np.zeros((10, 20, 3), np.uint8)

    monkeypatch.setattr(figures, "film_strip", strip)
    found = pictures.strips()
    assert {name: len(picture) for name, picture in found.items()} == {
        "figure-1": 40,
        "figure-1-recommended": 40,
    }
    assert [title.startswith("Fig. 1, c1c2c3, as written") for _, _, title, _ in rows] == [True] + [
        False
    ] * 7
    numbers, boxes, _, words = rows[0]
    assert numbers == list(words)
    assert list(boxes) == [TRUTH, "said at once (online)", "in the end (revised)"]
    run = pictures.runs["as written"]["c1c2c3"]
    np.testing.assert_array_equal(boxes["said at once (online)"], run.boxes)
    np.testing.assert_array_equal(boxes["in the end (revised)"], run.revised)
    assert (run.boxes != run.revised).any()


def test_overlap_is_that_of_the_runs_with_lamp_and_occlusion_shaded(pictures):
    axes = pictures.overlaps().axes
    assert [one.get_title() for one in axes[:2]] == list(PRESETS)
    assert [one.get_ylabel().split("\n")[0] for one in axes[::2]] == ["revised", "online"]
    truth = datasets.load(NAME)
    for row, trace in enumerate(("revised", "online")):
        for column, words in enumerate(PRESETS):
            for line, run in zip(
                axes[2 * row + column].lines, pictures.runs[words].values(), strict=True
            ):
                expected = overlap(truth.boxes, run.boxes_in(trace))
                np.testing.assert_allclose(line.get_ydata(), expected)
    lamp, *hidden = axes[0].patches
    assert (lamp.get_x(), lamp.get_width()) == (29.5, 15)
    assert sum(patch.get_width() for patch in hidden) == (truth.visibility < 0.5).sum() > 0


def test_outliers_have_gaps_where_an_occlusion_is_declared(pictures):
    figure = pictures.outliers()
    assert "a line that is missing" in figure.get_suptitle().replace("\n", " ")
    written, _ = figure.axes
    runs = pictures.runs["as written"]
    *lines, level = written.lines
    assert set(level.get_ydata()) == {0.25}
    for line, run in zip(lines, runs.values(), strict=True):
        shown = np.asarray(line.get_ydata())
        gaps = np.isnan(shown)
        assert gaps[run.details["occluded"] == 1].all()
        np.testing.assert_array_equal(shown[~gaps], run.details["outliers"][~gaps])
        assert 0 < gaps.sum() < 60


def test_losses_are_shares_of_the_scenes(scores):
    axes = loss_plot(scores).axes
    intensity, rgb, invariants, arctan = axes[0].lines
    assert axes[0].get_ylabel() == "revised\nshare"
    assert rgb.get_ydata().tolist() == [1.0] * 20 + [0.5] * 40
    for line in (intensity, invariants, arctan, *axes[1].lines, *axes[2].lines):
        assert set(line.get_ydata()) == {1.0}
    assert loss_plot(scores[:0]) is None


def test_a_sign_is_as_good_as_its_hits_and_false_alarms(tables):
    points = roc_points(tables["ng-15"].query("features == 'rgb'"))
    (gamma,) = points[points["marked"]].to_dict("records")
    assert gamma["threshold"] == pytest.approx(0.25)
    assert gamma["hit_rate"] == 1.0
    assert gamma["false_rate"] == pytest.approx(1 / 3)
    assert points["false_rate"].iloc[-1] == 1.0
    assert points["hit_rate"].iloc[0] == 0.0
    (axes,) = sign_plot(tables).axes
    assert [len(line.get_xdata()) for line in axes.lines] == [0, 0, 101, 1, 101, 1, 0, 0, 0]
    assert sign_plot({}) is None


def test_what_is_drawn_is_what_the_experiment_runs():
    run = {contestant(text).label for text in read_experiment(EXPERIMENT).trackers}
    assert {contestant(text).label for text in TEXTS} <= run
