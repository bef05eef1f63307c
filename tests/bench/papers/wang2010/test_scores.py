"""Runs as one tidy frame: what their labels say, and what readings they belong to."""

import pandas as pd
import pytest

import bench
from bench.experiments.experiment import Experiment, SequenceSource
from bench.papers.wang2010.courses import CUP, HAND, TABLE_TENNIS
from bench.papers.wang2010.scores import by_number, labels_of, tidy_scores, with_shared_runs


@pytest.mark.parametrize(
    ("text", "sequence", "expected"),
    [
        ("wang2010:preset=as-written", TABLE_TENNIS, ("as-written", "", "fused", "paper", 60)),
        ("wang2010", HAND, ("recommended", "", "fused", "paper", 60)),
        ("wang2010:particles=15", CUP, ("recommended", "", "fused", "paper", 15)),
        ("wang2010:particles=15", HAND, ("recommended", "", "fused", "other", 15)),
        ("wang2010:sigma=0.2:radius=10", CUP, ("recommended", "sigma=0.2", "fused", "other", 60)),
        ("wang2010:beta=0", HAND, ("recommended", "", "colour", "paper", 60)),
        ("wang2010:alpha=1:beta=0", HAND, ("recommended", "", "hue", "paper", 60)),
        ("wang2010:alpha=1", HAND, ("recommended", "", "alpha=1", "paper", 60)),
        ("wang2010:beta=0.5", HAND, ("recommended", "", "beta=0.5", "paper", 60)),
        ("wang2010:alpha=0.5:beta=0", HAND, ("recommended", "", "alpha=0.5:beta=0", "paper", 60)),
        ("particle-filter:radius=3.87", HAND, ("recommended", "", "fused", "paper", 400)),
        ("particle-filter:particles=60", CUP, ("recommended", "", "fused", "other", 60)),
        (
            "camshift-improved:difference_window=1",
            HAND,
            ("recommended", "difference_window=1", "fused", "any", 0),
        ),
        ("camshift:window=adaptive", HAND, ("any", "any", "any", "any", 0)),
        ("opencv-camshift", HAND, ("any", "any", "any", "any", 0)),
    ],
)
def test_labels_say_how_a_tracker_was_run(text, sequence, expected):
    labels = labels_of(text, sequence)
    columns = ("preset", "variant", "model", "budget", "particles")
    assert tuple(labels[column] for column in columns) == expected


def test_only_what_a_tracker_has_is_told_apart():
    told = {
        text: tuple(labels_of(text, HAND)[column] for column in ("radius", "reach", "window"))
        for text in (
            "wang2010",
            "wang2010:radius=10",
            "wang2010:particles=400",
            "particle-filter",
            "particle-filter:radius=3.87",
            "particle-filter:particles=60",
            "particle-filter:particles=60:radius=10",
            "particle-filter:particles=60:radius=3.87",
            "camshift",
            "camshift:window=adaptive",
            "camshift-improved:window=adaptive",
            "opencv-camshift",
        )
    }
    assert list(told.values()) == [
        ("rule", "any", "any"),
        ("10", "any", "any"),
        ("any", "any", "any"),
        ("any", "rule", "any"),
        ("rule", "3.87", "any"),
        ("rule", "rule", "any"),
        ("10", "rule", "any"),
        ("rule", "3.87", "any"),
        ("any", "any", "fixed"),
        ("any", "any", "adaptive"),
        ("any", "any", "adaptive"),
        ("any", "any", "any"),
    ]


def test_the_improved_camshift_as_written_serves_another_preset_and_nothing_else_does():
    texts = (
        "wang2010:preset=as-written",
        "particle-filter:preset=as-written",
        "particle-filter:preset=as-written:particles=60",
        "particle-filter:preset=as-written:beta=0",
        "particle-filter",
        "camshift-improved:preset=as-written:window=adaptive",
        "camshift-improved:preset=as-written:difference_window=1",
        "camshift",
    )
    scores = pd.DataFrame([labels_of(text, HAND) for text in texts])
    shared = with_shared_runs(scores)
    pd.testing.assert_frame_equal(shared.iloc[: len(scores)], scores)
    added = shared.iloc[len(scores) :]
    assert added[["tracker", "preset", "variant", "reach", "window"]].to_numpy().tolist() == [
        ["camshift-improved", "recommended", "", "any", "adaptive"],
    ]


def test_a_radius_of_ten_by_the_formula_is_on_both_curves_and_one_number_is_none():
    texts = (
        "wang2010",
        "wang2010:radius=10",
        "particle-filter",
        "particle-filter:particles=60",
        "particle-filter:particles=60:radius=10",
        "particle-filter:radius=3.87",
        "particle-filter:beta=0",
        "camshift",
    )
    scores = pd.DataFrame([{**labels_of(t, HAND), "sequence": TABLE_TENNIS} for t in texts])
    found = by_number(scores)[["tracker", "particles", "radius"]].to_numpy().tolist()
    assert sorted(found) == [
        ["particle-filter", 60, "10"],
        ["particle-filter", 60, "rule"],
        ["particle-filter", 400, "10"],
        ["particle-filter", 400, "rule"],
    ]
    assert by_number(scores.assign(sequence=HAND)).empty


def test_every_run_is_a_row_with_its_reading_and_its_course(tmp_path):
    texts = (
        "wang2010:preset=as-written:particles=20",
        "particle-filter:particles=20:sigma=0.3",
        "camshift",
    )
    source = "plain/target:length=30"
    folder = bench.run(
        Experiment("trial", texts, (SequenceSource(source),), repetitions=2), tmp_path, jobs=1
    )
    scores = tidy_scores(folder).set_index("text")
    assert len(scores) == 5
    assert set(scores["name"]) == {source}
    assert set(scores["light"]) == {"even"}
    assert scores.loc["camshift", "tolerated"] == 1.0
    native = bench.score(bench.evaluate("camshift", source), source)
    assert scores.loc["camshift", "centre_error"] == native["centre_error"]
    ours = scores.loc[texts[0]]
    assert (ours["effective_sample_size"] > 0.9).all()
    assert scores.loc[texts[1], "variant"].tolist() == ["sigma=0.3"] * 2
    assert pd.isna(scores.loc["camshift", "effective_sample_size"])
