"""Figures from stored runs on short scenes: that they show these, and only what was asked for."""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest

import datasets
from bench.papers import Effort, load_paper
from bench.papers.context import Context
from bench.papers.figures import draw_figure
from bench.papers.nummiaro2003 import figures
from bench.papers.runs import StoredRuns
from datasets.text_form import format_text

# The target is hidden about frame 20 and out of view about frame 40.
NAME = datasets.load("plain/target:length=60:occlusion=1:absence=12").name
SCENES = "plain/target:length=20"
WRITTEN = "nummiaro2003:preset=as-written"
WITHOUT = f"{WRITTEN}:model_update=false"
PAPER = load_paper("nummiaro2003")
READING = "together, factors, σ 0.05"
A_READING = format_text(
    f"{WRITTEN}:update_reading=coefficient",
    PAPER.description.figure["figure-9-readings"].panels[READING],
)


@pytest.fixture(scope="module")
def stored(tmp_path_factory, store_runs):
    root, asked = tmp_path_factory.mktemp("results"), {}
    experiments = {
        "figure-6": ((WRITTEN, WITHOUT), (NAME,), 2),
        "figure-8": ((WRITTEN, WITHOUT), (SCENES, f"{SCENES}:scene=2"), 2),
        "figure-9": ((A_READING, f"{A_READING}:model_update=false"), (f"{SCENES}:scene=9",), 1),
    }
    for name, told in experiments.items():
        asked[f"nummiaro2003-{name}"] = store_runs(root / f"nummiaro2003-{name}", *told)
    return StoredRuns(root, asked)


@pytest.fixture(autouse=True)
def short_scenes(monkeypatch):
    for key in ("PERSON", "CAR", "STUDENTS"):
        monkeypatch.setattr(figures, key, NAME)
    monkeypatch.setattr(figures, "begun_empty", datasets.load)
    yield
    plt.close("all")


def ellipses(n, x):
    return pd.DataFrame({"x": x + np.arange(n), "y": 50.0, "half_width": 9.0, "half_height": 14.0})


@pytest.fixture
def measured():
    """What is measured beside the runs, of two scenes and presets; that of the first is shown."""
    places = [(x, y) for y in (40.5, 41.5, 42.5) for x in (30.5, 31.5)]
    surface = pd.DataFrame(places, columns=["x", "y"]).assign(frame=3, coefficient=np.arange(6) / 9)
    drawn = [ellipses(4, 30.0).assign(kind="particle"), ellipses(1, 31.0).assign(kind="mean")]
    waiting = [
        ellipses(5, x).assign(frame=frame, tracking=tracking, weight=0.2)
        for x, frame, tracking in ((10.0, 4, 0.0), (20.0, 6, 0.0), (40.0, 8, 1.0), (60.0, 9, 1.0))
    ]
    one = {
        "surface": surface,
        "surface_particles": pd.concat(drawn).assign(frame=3),
        "entrance_particles": pd.concat(waiting),
    }
    tables = {
        key: pd.concat(
            rows.assign(name=name, preset=preset)
            for name in (NAME, "plain/target")
            for preset in ("recommended", "as-written")
        )
        for key, rows in one.items()
    }
    regions = pd.DataFrame({"x": [0.0], "y": [20.0], "width": [30.0], "height": [60.0]})
    elsewhere = regions.assign(name="plain/target", x=99.0)
    return {**tables, "entrance_regions": pd.concat([regions.assign(name=NAME), elsewhere])}


def known(stored=None, tables=None):
    """What hooks are told, with these runs and tables."""
    context = Context(PAPER.description, PAPER.claims, None, None, Effort(), {}, pd.DataFrame())
    context.tables.update(tables or {})
    vars(context)["stored"] = stored
    return context


def test_figures_without_runs_are_left_out(tmp_path):
    context = known(StoredRuns(tmp_path, {}), {"run_times": pd.DataFrame({"sequence": []})})
    for hook in ("surface", "entrance", "trajectories", "times"):
        assert getattr(figures, hook)(context) is None
    assert set(figures.appearances(context).values()) == {None}
    for entry in PAPER.description.figure.values():
        assert entry.hook or draw_figure(entry, context) is None


def test_half_axes_over_frames_are_those_of_the_runs_and_of_the_truth(stored):
    entry = PAPER.description.figure["figure-9"].model_copy(update={"sequences": (SCENES,)})
    (axes,) = draw_figure(entry, known(stored)).axes
    truth, *lines = axes.lines
    np.testing.assert_allclose(truth.get_ydata(), datasets.load(SCENES).boxes[:, 2] / 2)
    for line, text in zip(lines, (WITHOUT, WRITTEN), strict=True):
        runs = stored.of("nummiaro2003-figure-8", SCENES, text)
        assert [run.identity.repetition for run in runs] == [0, 1]
        widths = np.median([run.boxes[1:, 2] / 2 for run in runs], axis=0)
        np.testing.assert_allclose(line.get_ydata()[1:], widths)


def test_small_multiples_are_of_the_scenes_and_the_readings_that_were_run(stored):
    def drawn(name, scenes):
        told = {"sequences": (SCENES,), "scenes": scenes}
        entry = PAPER.description.figure[name].model_copy(update=told)
        return draw_figure(entry, known(stored)).axes

    (axes,) = drawn("figure-9-readings", (8, 9))
    assert (axes.get_title(), axes.get_ylabel()) == ("scene 9", f"{READING}\nHx [px]")
    (run,) = stored.of("nummiaro2003-figure-9", f"{SCENES}:scene=9", A_READING)
    np.testing.assert_allclose(axes.lines[-1].get_ydata()[1:], run.details["half_width"][1:])
    assert [one.get_title() for one in drawn("figure-9-scenes", (0, 1, 2))] == [
        "scene 0",
        "scene 2",
    ]


def test_appearances_have_the_threshold_and_the_shades_of_their_runs(stored):
    plots = figures.appearances(known(stored))
    upper, lower = plots["figure-7"].axes
    runs = stored.of("nummiaro2003-figure-6", NAME, WRITTEN)
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


def test_the_entrance_shows_samples_that_wait_and_the_first_that_track(measured):
    waiting, tracking = figures.entrance(known(tables=measured)).axes
    assert waiting.get_title() == "frame 4: samples wait"
    assert tracking.get_title() == "frame 8: tracking"
    offsets = [axes.collections[0].get_offsets()[:, 0].tolist() for axes in (waiting, tracking)]
    assert offsets == [[10, 11, 12, 13, 14], [40, 41, 42, 43, 44]]
    assert tracking.collections[-1].get_offsets().tolist() == [[42.0, 50.0]]
    assert (len(waiting.lines), len(tracking.lines)) == (1, 0)
    particles = measured["entrance_particles"]
    never = measured | {"entrance_particles": particles[particles["tracking"] == 0]}
    axes = figures.entrance(known(tables=never)).axes[1]
    assert axes.get_title() == "frame 6: not found yet"


def test_the_surface_is_that_of_the_first_scene_as_written(measured):
    measured["surface"].loc[measured["surface"]["preset"] == "recommended", "coefficient"] = 7.0
    left, right = figures.surface(known(tables=measured)).axes
    assert len(left.collections[0].get_offsets()) == 4
    assert right.get_zlim()[1] < 1
