"""Pictures of known runs: that they show these."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bench.claims.sides import run_key
from bench.metrics.overlap import overlap
from bench.papers import Effort, load_paper
from bench.papers.context import Context
from bench.papers.figures import draw_figure
from bench.papers.nguyen2002 import figures
from reports.overlay import TRUTH

PAPER = load_paper("nguyen2002")


@pytest.fixture
def context(made_run, made_truth):
    """Runs by all features, by RGB 100 pixels off in some frames; one of two scenes is lost."""
    run, beside = made_run((31, 50, 66)), made_run((31, 50, 66), beside=range(80, 90))
    truth = made_truth((30, 45), off=(60, 100))

    def of(experiment, sequence, text):
        return [beside if "features=rgb" in text else run]

    scores = pd.DataFrame(
        {"settled": run_key(figures._text(words, label)), "trace": trace, "scene": scene}
        | {"sequence": figures.RECORDING, "frames": 60}
        | {"first_loss": 20 if (label, words, trace, scene) == lost else 60}
        for lost in [("RGB", "as written", "revised", 1)]
        for words in figures.PRESETS
        for label in figures.FEATURES
        for trace in ("revised", "online")
        for scene in (0, 1)
    )
    signs = pd.DataFrame(
        {"features": "rgb", "hidden": [0.0, 0.0, 0.0, 1.0], "outliers": [0.1, 0.2, 0.3, 0.9]}
    )
    known = told_to_hooks(scores, of=of, truth=lambda *_: truth, sequences=lambda _: [])
    known.tables["ng-15"] = signs
    vars(known).update(run=run, truth=truth)
    return known


def told_to_hooks(scores, **stored):
    known = Context(PAPER.description, PAPER.claims, None, None, Effort(), {}, scores)
    vars(known)["stored"] = SimpleNamespace(**stored)
    return known


def test_the_strip_shows_an_occlusion_and_both_switches_of_the_lamp(made_truth):
    assert figures.chosen_frames(made_truth((20, 30), off=(50, 115))) == {
        17: "a) before",
        25: "b) hidden",
        40: "c) after",
        60: "d) lamp off",
        119: "lamp on again",
    }


def test_strips_have_a_row_for_each_kind_of_features_the_papers_first(context, monkeypatch):
    rows = []

    def strip(image_of, numbers, boxes, title, columns, *, words):
        rows.append((title, boxes))
        return np.zeros((10, 20, 3), np.uint8)

    monkeypatch.setattr(figures, "film_strip", strip)
    monkeypatch.setattr(figures.datasets, "load", lambda name: [])
    found = figures.strips(context)
    assert {name: len(picture) for name, picture in found.items()} == {
        "figure-1": 40,
        "figure-1-recommended": 40,
    }
    title, boxes = rows[0]
    assert title.startswith("Fig. 1, c1c2c3, as written")
    assert list(boxes) == [TRUTH, "said at once (online)", "in the end (revised)"]
    np.testing.assert_array_equal(boxes["said at once (online)"], context.run.boxes)
    np.testing.assert_array_equal(boxes["in the end (revised)"], context.run.revised)


def drawn(name, context):
    return draw_figure(PAPER.description.figure[name], context)


def test_overlap_is_that_of_the_runs_with_lamp_and_occlusion_shaded(context):
    axes = drawn("lights-overlap", context).axes
    said = [f"{words}, {trace}" for words in figures.PRESETS for trace in ("revised", "online")]
    assert [one.get_ylabel().split("\n")[0] for one in axes] == said
    for one, boxes in zip(axes, (context.run.revised, context.run.boxes), strict=False):
        intensity, rgb, *_ = one.lines
        np.testing.assert_allclose(intensity.get_ydata(), overlap(context.truth.boxes, boxes))
        assert (np.asarray(rgb.get_ydata())[80:90] == 0).all()
    lamp, hidden = axes[0].patches
    assert (lamp.get_x(), lamp.get_width()) == (59.5, 40)
    assert (hidden.get_x(), hidden.get_width()) == (29.5, 16)


def test_outliers_have_gaps_where_an_occlusion_is_declared(context):
    *lines, level = drawn("lights-outliers", context).axes[0].lines
    assert set(level.get_ydata()) == {0.25}
    gaps = np.isnan(np.asarray(lines[0].get_ydata()))
    np.testing.assert_array_equal(gaps[1:], context.run.details["occluded"][1:] == 1)


def test_losses_are_shares_of_the_scenes(context):
    axes = figures.losses(context).axes
    intensity, rgb, invariants, arctan = axes[0].lines
    assert axes[0].get_ylabel() == "revised\nshare"
    assert rgb.get_ydata().tolist() == [1.0] * 20 + [0.5] * 40
    for line in (intensity, invariants, arctan, *axes[1].lines, *axes[2].lines):
        assert set(line.get_ydata()) == {1.0}


def test_a_sign_is_as_good_as_its_hits_and_false_alarms(context):
    points = figures.roc_points(context.tables["ng-15"])
    (gamma,) = points[points["marked"]].to_dict("records")
    assert gamma["threshold"] == pytest.approx(0.25)
    assert gamma["hit_rate"] == 1.0
    assert gamma["false_rate"] == pytest.approx(1 / 3)
    assert (points["false_rate"].iloc[-1], points["hit_rate"].iloc[0]) == (1.0, 0.0)
    (axes,) = figures.sign(context).axes
    assert sorted(len(line.get_xdata()) for line in axes.lines)[-2:] == [1, 101]


def test_pictures_without_runs_are_none(context):
    nothing = told_to_hooks(context.scores[:0], of=lambda *_: [], sequences=lambda _: [])
    assert set(figures.strips(nothing).values()) == {None}
    for hook in (figures.losses, figures.sign):
        assert hook(nothing) is None
    for name in ("lights-overlap", "lights-outliers"):
        assert drawn(name, nothing) is None
