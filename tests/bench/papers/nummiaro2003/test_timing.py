"""The plain filter against the compiled tracker, and how times become numbers."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import bench
import datasets
import trackers
from bench.experiments.experiment import Experiment, SequenceSource
from bench.papers import Effort
from bench.papers.nummiaro2003 import timing
from bench.papers.nummiaro2003.plain import PlainFilter
from bench.papers.nummiaro2003.timing import (
    clock_rate,
    compiled_filter,
    cost_slopes,
    cost_times,
    plain_filter,
)
from bench.store.loading import load_results
from bench.store.results import Results

NAME = "plain/target"


@pytest.fixture(scope="module")
def images():
    return list(datasets.load(NAME)[:25])


def worst_difference(images, box, settings, plain_settings):
    seed = np.random.SeedSequence(5)
    tracker = trackers.create(
        "nummiaro2003", seed, preset="as-written", reinitialise=False, **settings
    )
    plain = PlainFilter(np.random.SeedSequence(5), **plain_settings)
    for one in (tracker, plain):
        one.init(images[0], box)
    worst, updates = 0.0, 0.0
    for image in images[1:]:
        threshold = plain.threshold
        plain.update(image)
        said = tracker.update(image)
        assert said.details["appearance_threshold"] == pytest.approx(threshold, abs=1e-9)
        centre, half_axes = plain.mean[:2], plain.mean[4:6]
        box_of_plain = np.concatenate([centre - half_axes, 2 * half_axes])
        worst = max(worst, float(np.abs(said.box - box_of_plain).max()))
        assert said.details["positive_appearances"] == plain.positive
        updates += said.details["updated"]
    return worst, updates


@pytest.mark.parametrize(
    ("settings", "follows"),
    [
        ({}, True),
        ({"particles": 30, "bins": 5}, True),
        ({"sigma": 0.05, "update_threshold": 0.2}, True),
        ({"update_threshold": 3.95}, False),
        ({"sigma": 0.3, "particles": 1}, True),
    ],
)
def test_the_tracker_and_the_plain_filter_give_the_same_estimates(images, settings, follows):
    box = datasets.load(NAME).boxes[0]
    worst, updates = worst_difference(images, box, settings, settings)
    assert worst < 1e-6
    assert (updates > 0) == follows


def test_an_ellipse_that_is_partly_outside_is_the_same_for_both(images):
    width = images[0].shape[1]
    box = np.array([width - 25.0, -12.5, 40.3, 60.7])
    worst, _ = worst_difference(images[:12], box, {}, {})
    assert worst < 1e-6


def test_slopes_are_those_of_lines_through_the_times():
    random = np.random.default_rng(1)
    values = np.repeat([50.0, 100, 200, 400], 6)
    seconds = 1e-4 + 2e-6 * values + 1e-5 * random.standard_normal(len(values))
    flat = 1e-4 + 1e-5 * random.standard_normal(len(values))
    costs = pd.concat(
        pd.DataFrame({"factor": name, "value": values, "seconds": times})
        for name, times in (("samples", seconds), ("bins", flat))
    )
    lines = cost_slopes(costs).set_index("factor")
    coefficients, covariance = np.polyfit(values, seconds, 1, cov=True)
    assert lines.loc["samples", "slope"] == pytest.approx(coefficients[0])
    half = lines.loc["samples", "upper_limit"] - coefficients[0]
    assert half == pytest.approx(2.0739 * np.sqrt(covariance[0, 0]), rel=1e-3)
    assert lines.loc["samples", "lower_limit"] == pytest.approx(coefficients[0] - half)
    assert lines.loc["bins", "lower_limit"] < 0 < lines.loc["bins", "upper_limit"]
    correlation = np.corrcoef(values, seconds)[0, 1]
    assert lines.loc["samples", "r_squared"] == pytest.approx(correlation**2)


@pytest.fixture
def short_sweeps(monkeypatch):
    sweeps = {"samples": (20, 200), "area": (0.5, 1.0), "bins": (4, 8)}
    monkeypatch.setattr(timing, "SWEEPS", sweeps)
    monkeypatch.setattr(timing, "ROUNDS", 3)


@pytest.mark.slow
def test_costs_are_measured_by_samples_area_and_bins(short_sweeps):
    found = cost_times(NAME, compiled_filter, 2)
    by_factor = found.groupby("factor")["value"].unique()
    _, _, width, height = datasets.load(NAME).boxes[0]
    assert sorted(by_factor["samples"]) == [20, 200]
    assert sorted(by_factor["bins"]) == [64, 512]
    assert sorted(by_factor["area"]) == pytest.approx(
        [np.pi / 4 * width * height * k for k in (0.5, 1)]
    )
    assert len(found) == 12
    plain = cost_times(NAME, plain_filter, 1).query("factor == 'samples'").set_index("value")
    assert (plain["seconds"] > 0).all()
    assert {*plain.index} == {20, 200}


@pytest.mark.slow
def test_the_clock_of_a_core_is_between_half_and_ten_gigahertz():
    assert 0.5e9 < clock_rate() < 10e9


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    tracker = "nummiaro2003:preset=as-written:particles=20"
    experiment = Experiment("t", (tracker,), (SequenceSource(NAME),), repetitions=2, timing=True)
    return bench.run(experiment, tmp_path_factory.mktemp("results"), jobs=1)


@pytest.mark.slow
def test_all_that_the_ledger_asks_for_is_measured(folder, monkeypatch, short_sweeps):
    monkeypatch.setattr(timing, "SEQUENCES", (NAME,))
    monkeypatch.setattr(timing, "STUDENTS", NAME)
    monkeypatch.setattr(timing, "TIMED", folder.name)
    cells = {folder.name: set(Results(folder).asked().cells)}
    context = SimpleNamespace(results=folder.parent, asked=cells, effort=Effort(quick=True))
    tables = timing.tables(context)
    runs, frames = tables["run_times"], len(datasets.load(NAME)) - 1
    clean = load_results(folder).query("disturbed == 0")
    assert len(runs) == frames * len(clean)
    assert len(tables["frame_times"]) == (frames if len(clean) else 0)
    for _, row in runs.groupby("repetition").head(2).iterrows():
        boxes = bench.evaluate(row["tracker"], NAME, row["repetition"]).boxes
        _, _, width, height = boxes[row["frame"]]
        assert row["area"] == pytest.approx(np.pi / 4 * width * height)
    assert len(tables["model_times"]) == 9
    ratio = tables["model_times"]["per_particle"] / tables["model_times"]["one"]
    assert (ratio > 0).all()
    profile = tables["profile"].set_index("implementation")["weighting_share"]
    assert (profile[["compiled", "plain"]] > 0).all()
    assert len(tables["time_slopes"]) == 6
    plain = tables["plain_times"].iloc[0]
    times = tables["times"].groupby("what")["value"].median()
    assert times["plain"] == pytest.approx(plain["milliseconds"])
    assert times["plain"] > 1.5 * times["compiled"] or not len(clean)
    slower = times["clock"] * 1e9 / 800e6
    assert plain["milliseconds_at_800_mhz"] == pytest.approx(slower * plain["milliseconds"])
    assert {"models", "weighting, plain", "weighting, compiled"} <= set(times.index)
