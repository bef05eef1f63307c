"""The plain filter against the compiled tracker, and how times become numbers."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import datasets
import trackers
from bench.papers import Effort
from bench.papers.nummiaro2003 import timing
from bench.papers.nummiaro2003.plain import PlainFilter
from bench.papers.nummiaro2003.timing import (
    cost_slopes,
)
from bench.papers.timing import ROUNDS

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
        pd.DataFrame({"implementation": "plain", "factor": name, "value": values, "seconds": times})
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


@pytest.mark.slow
def test_all_that_the_ledger_asks_for_is_measured(monkeypatch, tmp_path):
    monkeypatch.setattr(timing, "SEQUENCES", (NAME,))
    monkeypatch.setattr(timing, "STUDENTS", NAME)
    sweeps = {"samples": (20, 200), "area": (0.5, 1.0), "bins": (4, 8)}
    monkeypatch.setattr(timing, "SWEEPS", sweeps)
    known = {"sequence": NAME, "repetition": 0, "frame": [1, 2, 3], "disturbed": [0, 0, 1]}
    known |= {"seconds": 1e-3, "decoded": 2e-3, "half_width": 3.0, "half_height": 2.0}
    runs = pd.DataFrame(known)
    monkeypatch.setattr(timing, "frame_times", lambda *_: runs)
    context = SimpleNamespace(
        results=tmp_path, folder=tmp_path, asked={timing.TIMED: ()}, effort=Effort(quick=True)
    )
    tables = timing.tables(context)
    assert tables["frame_times"]["area"].tolist() == pytest.approx([6 * np.pi] * 2)
    assert len(tables["model_times"]) == ROUNDS
    assert len(tables["time_slopes"]) == 6
    times = tables["times"].groupby("what")["value"].median()
    assert times["compiled"] == pytest.approx(1.0)
    assert times["as decoded"] == pytest.approx(2.0)
    (plain,) = tables["plain_times"].to_dict("records")
    assert plain["low"] < plain["milliseconds"] < plain["high"]
    assert plain["low_at_800_mhz"] < plain["at_800_mhz"] < plain["high_at_800_mhz"]
    assert {"models", "weighting, plain", "weighting, compiled", "reference"} <= set(times.index)
    assert (times.drop(["weighting, plain", "weighting, compiled"]) > 0).all()


def test_what_is_enlarged_is_so_about_its_centre(images):
    box = datasets.load(NAME).boxes[0]
    begun = []
    made = SimpleNamespace(init=lambda image, box: begun.append(box), update=None)
    timing._Enlarged(lambda **_: made, "area", 4.0).init(images[0], box)
    assert begun[0][:2] + begun[0][2:] / 2 == pytest.approx(box[:2] + box[2:] / 2)
    assert begun[0][2:] == pytest.approx(2 * box[2:])
