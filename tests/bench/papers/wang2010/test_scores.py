"""Runs as one tidy frame: what their labels say, and what readings they belong to."""

import pandas as pd
import pytest

import bench
from bench.experiment import Experiment, SequenceSource
from bench.papers.wang2010.courses import CUP, HAND, TABLE_TENNIS
from bench.papers.wang2010.scores import labels_of, tidy_scores, with_shared_runs


@pytest.mark.parametrize(
    ("text", "sequence", "expected"),
    [
        ("wang2010:preset=as-written", TABLE_TENNIS, ("as-written", "", "fused", "paper", 60)),
        ("wang2010", HAND, ("recommended", "", "fused", "paper", 60)),
        ("wang2010:particles=15", CUP, ("recommended", "", "fused", "paper", 15)),
        ("wang2010:particles=15", HAND, ("recommended", "", "fused", "other", 15)),
        ("wang2010:sigma=0.2:radius=10", CUP, ("recommended", "radius=10:sigma=0.2", "fused",
                                               "other", 60)),
        ("wang2010:beta=0", HAND, ("recommended", "", "colour", "paper", 60)),
        ("wang2010:alpha=1:beta=0", HAND, ("recommended", "", "hue", "paper", 60)),
        ("wang2010:alpha=1", HAND, ("recommended", "", "alpha=1", "paper", 60)),
        ("wang2010:beta=0.5", HAND, ("recommended", "", "beta=0.5", "paper", 60)),
        ("wang2010:alpha=0.5:beta=0", HAND, ("recommended", "", "alpha=0.5:beta=0", "paper", 60)),
        ("particle-filter:radius=3.87", HAND, ("recommended", "", "fused", "paper", 400)),
        ("particle-filter:particles=60", CUP, ("recommended", "", "fused", "other", 60)),
        ("camshift-improved:difference_window=1", HAND, ("recommended", "difference_window=1",
                                                         "fused", "any", 0)),
        ("camshift:window=adaptive", HAND, ("any", "any", "any", "any", 0)),
        ("opencv-camshift", HAND, ("any", "any", "any", "any", 0)),
    ],
)  # fmt: skip
def test_labels_say_how_a_tracker_was_run(text, sequence, expected):
    labels = labels_of(text, sequence)
    columns = ("preset", "variant", "model", "budget", "particles")
    assert tuple(labels[column] for column in columns) == expected


def test_only_what_a_tracker_has_is_told_apart():
    told = {
        text: (labels_of(text, HAND)["reach"], labels_of(text, HAND)["window"])
        for text in (
            "wang2010:radius=10", "particle-filter", "particle-filter:radius=3.87", "camshift",
            "camshift:window=adaptive", "camshift-improved:window=adaptive", "opencv-camshift",
        )
    }  # fmt: skip
    assert list(told.values()) == [
        ("any", "any"), ("rule", "any"), ("3.87", "any"), ("any", "fixed"), ("any", "adaptive"),
        ("any", "adaptive"), ("any", "any"),
    ]  # fmt: skip


def test_runs_serve_readings_that_make_no_difference_to_them():
    texts = (
        "wang2010:preset=as-written", "particle-filter:preset=as-written",
        "particle-filter:preset=as-written:radius=3.87", "particle-filter",
        "camshift-improved:preset=as-written:window=adaptive",
        "camshift-improved:preset=as-written:difference_window=1", "camshift",
    )  # fmt: skip
    scores = pd.DataFrame([labels_of(text, HAND) for text in texts])
    shared = with_shared_runs(scores)
    pd.testing.assert_frame_equal(shared.iloc[: len(scores)], scores)
    added = shared.iloc[len(scores) :]
    assert added[["tracker", "preset", "variant", "reach", "window"]].to_numpy().tolist() == [
        ["camshift-improved", "recommended", "", "any", "adaptive"],
        ["particle-filter", "as-written", "radius=10", "rule", "any"],
    ]


def test_every_run_is_a_row_with_its_reading_and_its_course(tmp_path):
    texts = (
        "wang2010:preset=as-written:particles=20", "particle-filter:particles=20:sigma=0.3",
        "camshift",
    )  # fmt: skip
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
