"""Figures from stored runs on short scenes: that they show these, and only what was asked for."""

import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

import datasets
from bench.evaluation.loop import run_in_lock_step
from bench.experiments.contestant import contestant
from bench.experiments.experiment import read_experiment
from bench.papers import drawing
from bench.papers.drawing import undrawn
from bench.papers.nummiaro2003 import figures
from bench.papers.nummiaro2003.figures import NUMBERS, READINGS, by_update, draw, scale_grid
from bench.papers.stored import StoredRuns, over_frames
from bench.store.asked import Asked
from bench.store.results import Results
from bench.store.truth import write_truth
from datasets.text_form import format_text

pytestmark = pytest.mark.slow

# The target is hidden about frame 20 and out of view about frame 40.
NAME = datasets.load("plain/target:length=60:occlusion=1:absence=12").name
SCENES = "plain/target:length=20"
WRITTEN = "nummiaro2003:preset=as-written"
WITHOUT = f"{WRITTEN}:model_update=false"
A_READING = format_text(WRITTEN, READINGS["together, factors, σ 0.05"])


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    root = tmp_path_factory.mktemp("results")
    experiments = {
        "figure-4": ((WRITTEN,), (NAME,), 1),
        "figure-6": ((WRITTEN, WITHOUT), (NAME,), 3),
        "figure-8": ((WRITTEN, WITHOUT), (SCENES, f"{SCENES}:scene=2"), 2),
        "figure-9": ((A_READING, f"{A_READING}:model_update=false"), (f"{SCENES}:scene=9",), 1),
        "figure-10": ((WRITTEN, WITHOUT), (NAME,), 1),
    }
    for name, (trackers, sequences, repetitions) in experiments.items():
        stored = Results(root / f"nummiaro2003-{name}")
        entries = [(contestant(text), i) for text in trackers for i in range(repetitions)]
        versions = {}
        for sequence in map(datasets.load, sequences):
            write_truth(stored.folder, sequence)
            for run in run_in_lock_step(entries, sequence).runs:
                assert stored.write(run)
                key = run.identity
                cell = key.tracker, key.sequence, key.repetition, key.protocol
                versions[cell] = key.version
        stored.prepare(Asked(name, versions))
    return root


@pytest.fixture
def asked(results):
    return {folder.name: set(Results(folder).asked().cells) for folder in results.iterdir()}


@pytest.fixture
def stored(results, asked):
    return StoredRuns(results, asked)


@pytest.fixture(autouse=True)
def short_scenes(monkeypatch):
    for key in ("PERSON", "CAR", "STUDENTS", "HEAD"):
        monkeypatch.setattr(figures, key, NAME)
    monkeypatch.setattr(figures, "TRAFFIC", SCENES)
    monkeypatch.setattr(figures, "PAPERS_FRAME", 41)
    monkeypatch.setattr(figures, "begun_empty", datasets.load)


def ellipses(n, x):
    return pd.DataFrame({"x": x + np.arange(n), "y": 50.0, "half_width": 9.0, "half_height": 14.0})


@pytest.fixture
def tables():
    """What is measured beside the runs, of two scenes and presets; that of the first is shown."""
    places = [(x, y) for y in (40.5, 41.5, 42.5) for x in (30.5, 31.5)]
    surface = pd.DataFrame(places, columns=["x", "y"]).assign(frame=3, coefficient=np.arange(6) / 9)
    drawn = [ellipses(4, 30.0).assign(kind="particle"), ellipses(1, 31.0).assign(kind="mean")]
    waiting = [
        ellipses(5, x).assign(frame=frame, tracking=tracking, weight=0.2)
        for x, frame, tracking in ((10.0, 4, 0.0), (20.0, 6, 0.0), (40.0, 8, 1.0), (60.0, 9, 1.0))
    ]
    regions = pd.DataFrame({"x": [0.0], "y": [20.0], "width": [30.0], "height": [60.0]})
    times = pd.DataFrame(
        {"sequence": NAME, "repetition": [0, 0, 1, 1], "frame": [1, 2, 1, 2], "area": 400.0}
    )
    one = {
        "surface": surface,
        "surface_particles": pd.concat(drawn).assign(frame=3),
        "entrance_particles": pd.concat(waiting),
    }
    both = {
        key: pd.concat(
            rows.assign(name=name, preset=preset)
            for name in (NAME, "plain/target")
            for preset in ("recommended", "as-written")
        )
        for key, rows in one.items()
    }
    elsewhere = regions.assign(name="plain/target", x=99.0)
    both["entrance_regions"] = pd.concat([regions.assign(name=NAME), elsewhere])
    return both | {"run_times": times.assign(seconds=[0.001, 0.002, 0.003, 0.004])}


@pytest.fixture
def unwritten(monkeypatch):
    """Pictures are made, but not rendered: that takes longest."""
    for writer in ("write_figure", "write_film_strip"):
        monkeypatch.setattr(drawing, writer, lambda path, _: path)


def test_figures_come_in_the_papers_order(results, asked, tables, tmp_path, unwritten):
    paths = draw(results, tmp_path / "new", asked, tables)
    assert [path.stem for path in paths] == [
        *("figure-2", "figure-3", "figure-4", "figure-5", "figure-6"),
        *("figure-7", "figure-7-without-update", "figure-8"),
        *("figure-9", "figure-9-readings", "figure-9-scenes", "figure-10"),
    ]
    assert undrawn(paths, NUMBERS) == []


def test_every_figure_is_drawn_whole(results, asked, tables, tmp_path):
    for path in draw(results, tmp_path / "new", asked, tables):
        assert min(cv2.imread(str(path)).shape[:2]) > 250


def test_figures_without_runs_are_left_out_with_a_word(results, asked, tables, tmp_path, unwritten):
    none = {"run_times": tables["run_times"][:0]}
    assert draw(results, tmp_path, {}, none) == []
    only = {name: cells for name, cells in asked.items() if name.endswith("figure-8")}
    paths = draw(results, tmp_path, only, none)
    assert [path.stem for path in paths] == ["figure-8", "figure-9", "figure-9-scenes"]
    assert undrawn(paths, NUMBERS) == [
        "Not drawn, for want of finished runs: Fig. 2, 3, 4, 5, 6, 7, 10."
    ]


def test_runs_are_told_apart_by_sequence_and_parameters_in_order_of_repetitions(stored):
    runs = by_update(stored, "figure-8", f"{SCENES}:scene=2")
    assert {label: len(found) for label, found in runs.items()} == {
        "without update": 2,
        "with update": 2,
    }
    for label, found in runs.items():
        assert [run.identity.repetition for run in found] == [0, 1]
        assert {run.identity.sequence for run in found} == {f"{SCENES}:scene=2"}
        updates = {run.identity.parameters["model_update"] for run in found}
        assert updates == {label == "with update"}
    none = {"without update": [], "with update": []}
    assert by_update(stored, "figure-8", SCENES, sigma=0.2) == none
    assert by_update(stored, "figure-8", NAME) == none
    assert by_update(stored, "figure-99", SCENES) == none


def test_runs_that_nobody_asked_for_or_that_failed_are_not_shown(results, asked, tmp_path):
    copy = Path(shutil.copytree(results, tmp_path / "copy"))
    experiment = "nummiaro2003-figure-6"
    folder = Results(copy / experiment)
    some = {cell for cell in asked[experiment] if cell[2] != 2}
    for file in folder.files():
        run = folder.read(file)
        if run.identity.repetition == 0:
            file.unlink()
            folder.write(replace(run, failure="frame 3: why", details={}))
    (left,) = by_update(StoredRuns(copy, {experiment: some}), "figure-6", NAME)["with update"]
    assert left.identity.repetition == 1


def test_the_half_axis_is_that_of_the_runs_and_of_the_truth(stored):
    (axes,) = figures._half_width(stored).axes
    truth, without, updated = axes.lines
    boxes = datasets.load(SCENES).boxes
    np.testing.assert_allclose(truth.get_ydata(), boxes[:, 2] / 2)
    for line, runs in zip(
        (without, updated), by_update(stored, "figure-8", SCENES).values(), strict=True
    ):
        widths = np.median([run.boxes[1:, 2] / 2 for run in runs], axis=0)
        assert line.get_xdata().tolist() == list(range(1, 20))
        np.testing.assert_allclose(line.get_ydata(), widths)


def test_appearances_have_the_threshold_and_the_shades_of_their_runs(stored):
    upper, lower = figures._appearances(stored, update=True).axes
    runs = by_update(stored, "figure-6", NAME)["with update"]
    counts = np.median([run.details["positive_appearances"][1:] for run in runs], axis=0)
    np.testing.assert_allclose(upper.lines[0].get_ydata(), counts)
    assert set(upper.lines[1].get_ydata()) == {10.0}
    truth = stored.truth("nummiaro2003-figure-6", runs[0])
    shaded = np.zeros(60, bool)
    for patch in upper.patches:
        shaded[int(np.ceil(patch.get_x())) : int(np.ceil(patch.get_x() + patch.get_width()))] = True
    hidden = ~np.isfinite(truth.boxes[:, 0]) | (truth.visibility < 0.5)
    assert shaded.tolist() == hidden.tolist()
    assert 0 < hidden.sum() < 40
    share = lower.collections[0].get_paths()[0].vertices[:, 1].max()
    initialising = np.mean([run.details["mode"][1:] == 0 for run in runs], axis=0)
    assert share == pytest.approx(initialising.max())


def test_the_entrance_shows_samples_that_wait_and_the_first_that_track(tables):
    waiting, tracking = figures._entrance(tables).axes
    assert waiting.get_title() == "frame 4: samples wait"
    assert tracking.get_title() == "frame 8: tracking"
    offsets = [axes.collections[0].get_offsets()[:, 0].tolist() for axes in (waiting, tracking)]
    assert offsets == [[10, 11, 12, 13, 14], [40, 41, 42, 43, 44]]
    assert tracking.collections[-1].get_offsets().tolist() == [[42.0, 50.0]]
    assert len(waiting.lines) == 1
    assert not tracking.lines
    particles = tables["entrance_particles"]
    never = tables | {"entrance_particles": particles[particles["tracking"] == 0]}
    assert figures._entrance(never).axes[1].get_title() == "frame 6: not found yet"


def test_the_surface_is_that_of_the_first_scene_as_written(tables):
    tables["surface"].loc[tables["surface"]["preset"] == "recommended", "coefficient"] = 7.0
    left, right = figures._surface(tables).axes
    assert len(left.collections[0].get_offsets()) == 4
    assert right.get_zlim()[1] < 1


def test_small_multiples_are_of_the_readings_that_were_run(stored):
    (axes,) = scale_grid(stored, "figure-9", READINGS, (8, 9), "a title").axes
    assert axes.get_title() == "scene 9"
    assert axes.get_ylabel() == "together, factors, σ 0.05\nHx [px]"
    parameters = READINGS["together, factors, σ 0.05"]
    runs = by_update(stored, "figure-9", f"{SCENES}:scene=9", **parameters)["with update"]
    half_widths = runs[0].details["half_width"]
    np.testing.assert_allclose(axes.lines[-1].get_ydata(), half_widths[1:])
    plot = scale_grid(stored, "figure-8", {"as written": {}}, (0, 1, 2), "a title")
    assert [axes.get_title() for axes in plot.axes] == ["scene 0", "scene 2"]
    assert scale_grid(stored, "figure-9", {"as written": {}}, (0,), "a title") is None


def test_the_readings_are_those_that_the_experiment_runs():
    run = {contestant(text).label for text in read_experiment("nummiaro2003-figure-9").trackers}
    for parameters in READINGS.values():
        for update in ({}, {"model_update": False}):
            wanted = {"preset": "as-written", **parameters, **update}
            assert contestant(format_text("nummiaro2003", wanted)).label in run


def test_strips_say_when_a_run_is_initialising_and_hold_the_papers_frame(stored, monkeypatch):
    asked_for = []

    def strip(image_of, numbers, boxes, title, columns, *, shape, shades, words):
        asked_for.append((numbers, sorted(boxes), title, shape, words))
        return np.zeros((10, 20, 3), np.uint8)

    monkeypatch.setattr(figures, "film_strip", strip)
    assert figures.strip(stored, "figure-6", NAME, 12).shape == (20, 20, 3)
    assert figures.strip(stored, "figure-10", NAME, 12, together=True).shape == (10, 20, 3)
    assert figures.strip(stored, "figure-10", SCENES, 12) is None
    students = [call for call in asked_for if "Fig. 6" in call[2]]
    assert [call[1][1] for call in students] == ["without update", "with update"]
    for numbers, _, title, shape, words in students:
        assert 41 in numbers
        assert shape == "ellipse"
        update = "without" not in title
        run = by_update(stored, "figure-6", NAME)["with update" if update else "without update"][0]
        initialising = {number for number in numbers if run.details["mode"][number] == 0}
        assert set(words) == initialising
    assert any(call[4] for call in students)
    (head,) = [call for call in asked_for if "Fig. 10" in call[2]]
    assert head[1] == ["truth", "with update", "without update"]


def test_details_over_frames_begin_after_the_given_one(stored):
    runs = {"a": by_update(stored, "figure-6", NAME)["with update"]}
    rows = over_frames(runs, "mode", "half_width")
    assert list(rows.columns) == ["label", "repetition", "mode", "half_width", "frame"]
    assert rows["frame"].min() == 1
    assert len(rows) == 3 * 59
    assert over_frames({"a": []}, "mode").empty
