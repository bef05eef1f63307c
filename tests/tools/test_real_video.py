"""Scores on real video: stored rows, their pages, stale versions and the rank correlation."""

import csv
import importlib.util
import json
from itertools import product
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest
from scipy.stats import spearmanr

from tools import real_video
from trackmark import datasets
from trackmark.bench.papers import real_video as stored
from trackmark.bench.papers.paper import read_paper

ROOT = Path(__file__).parents[2]
SEQUENCES = ROOT.parent / "shared" / "sequences"


@pytest.fixture
def scores():
    return stored.read_scores()


def rows_of(table):
    """Return the cells of the rows of a table in Markdown."""
    rows = [line.strip("| ").split(" | ") for line in table.splitlines() if line.startswith("| ")]
    return rows[2:]


def test_pages_have_the_stored_scores():
    for file, text in real_video.pages().items():
        assert file.read_text("utf-8") == text, "Run: python -m tools.real_video --write"


def test_stored_scores_are_complete(scores):
    pairs = set(zip(scores["tracker"], scores["sequence"], strict=True))
    assert pairs == {
        *product(real_video.TRACKERS, real_video.SEQUENCES),
        *product(real_video.SCENE_TRACKERS, real_video.SCENES),
    }
    assert len(scores) == len(pairs)
    assert scores[["mean_overlap", "success_rate"]].map(lambda x: 0 <= x <= 1).all(axis=None)
    assert np.isfinite(scores["ms_per_frame"]).all()


def test_order_of_published_trackers_is_that_of_their_scores():
    with (ROOT / "bench/analysis/published/otb100.csv").open() as file:
        sums = {}
        for row in csv.DictReader(file):
            if row["sequence"] in real_video.SEQUENCES:
                sums.setdefault(row["tracker"], []).append(float(row["mean_overlap"]))
    expected = sorted(sums, key=lambda name: -sum(sums[name]))
    text = real_video.PAGE.read_text("utf-8")
    block = text.partition("<!-- published -->")[2].partition("<!-- end -->")[0]
    ranked = [cell.partition(" ")[0] for row in rows_of(block) for cell in row[1].split(", ")]
    assert ranked == expected
    assert len(ranked) == 34
    means = text.partition("<!-- means -->")[2].partition("<!-- end -->")[0]
    listed = [row[0].partition(" ")[0] for row in rows_of(means) if "(published)" in row[0]]
    assert listed == [name for name in expected if f"{name} (published)" in real_video.PUBLISHED]
    for row in rows_of(means):
        if "(published)" in row[0]:
            values = sums[row[0].partition(" ")[0]]
            assert len(values) == 21
            assert row[1] == f"{np.mean(values):.2f}"


def test_stored_scores_are_current(scores):
    assert stored.stale_trackers(scores) == []


@pytest.mark.parametrize(
    ("column", "value"),
    [("version", "other"), ("tracker", "camshift:preset=removed"), ("tracker", "removed")],
)
def test_changed_tracker_is_stale(scores, column, value):
    scores.loc[scores["tracker"] == "camshift", column] = value
    assert stored.stale_trackers(scores) == [value if column == "tracker" else "camshift"]


@pytest.mark.parametrize(
    ("parameters", "is_stale"),
    [({"hue_bins": 16}, True), ({"removed_option": 1}, False), ({}, False)],
    ids=["other value", "removed parameter", "new parameters"],
)
def test_tracker_is_stale_if_a_parameter_has_another_value(scores, parameters, is_stale):
    row = (scores["tracker"] == "camshift") & scores["parameters"].notna()
    scores.loc[row, "parameters"] = json.dumps(parameters)
    assert stored.stale_trackers(scores) == ["camshift"] * is_stale


@pytest.mark.parametrize("sequence", ["Deer", "wang2010/hand:scene=400"])
def test_changed_sequence_is_stale(scores, sequence):
    is_changed = (scores["sequence"] == sequence) & (scores["tracker"] == "static")
    scores.loc[is_changed, "fingerprint"] = "0" * 16
    stale = stored.stale_trackers(scores)
    assert stale == ([*real_video.TRACKERS] if sequence == "Deer" else ["static"])


@pytest.fixture
def stale_file(scores, tmp_path, monkeypatch):
    """Replace the stored scores by those of another version of a tracker."""
    scores.loc[scores["tracker"] == "camshift", "version"] = "other"
    file = tmp_path / "real_video.csv"
    scores.to_csv(file, index=False)
    monkeypatch.setattr(stored, "FILE", file)


@pytest.mark.usefixtures("stale_file")
def test_stale_tracker_is_marked_on_the_pages():
    pages = {file.stem: text for file, text in real_video.pages().items()}
    for name in ("real-video", "wang2010"):
        assert "| camshift † |" in pages[name]
        assert "| static |" in pages[name]
        assert stored.STALE_NOTE.replace("_", r"\_") in pages[name].replace("\\`", "`")
    assert "†:" not in pages["multipart"]


@pytest.mark.usefixtures("stale_file")
def test_stale_tracker_stops_the_documentation_site():
    pytest.importorskip("mkdocs", reason="`make docs` and `make test-full` install MkDocs")
    from mkdocs.exceptions import PluginError

    spec = importlib.util.spec_from_file_location("site_pages", ROOT / "docs" / "site_pages.py")
    hook = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(hook)
    with pytest.raises(PluginError, match=r"earlier versions of camshift, .*tools.real_video"):
        hook.on_pre_build({})


def test_missing_opencv_tracker_has_its_sealed_version(scores, monkeypatch):
    def refuse(tracker):
        raise stored.TrackerError("the installed OpenCV has no such tracker")

    monkeypatch.setattr(stored, "tracker_state", refuse)
    state = scores[scores["tracker"] == "opencv-csrt"].iloc[0]
    assert stored._is_current("opencv-csrt", state["version"], state["parameters"])
    assert not stored._is_current("opencv-csrt", "other", state["parameters"])


def test_paper_table_has_its_trackers_and_references():
    labels = {row[0].text for row in stored.paper_table(read_paper("multipart")).rows}
    assert labels == {"multipart", "multipart:preset=robust", *stored.REFERENCES}


def frame_of(values):
    """Return rows for scores of shape (trackers, sequences) of one data set."""
    return pd.DataFrame(
        [
            {"data": "x", "tracker": tracker, "sequence": str(n), "mean_overlap": value}
            for tracker, row in zip(real_video.SCENE_TRACKERS, values, strict=True)
            for n, value in enumerate(row)
        ]
    )


def test_rank_agreement_equals_a_reference(scores):
    video, scenes = (scores[(scores["data"] == "OTB") == flag] for flag in (True, False))
    agreement, (low, high) = real_video.rank_agreement(video, scenes)
    means = scenes.groupby(["tracker", "data"])["mean_overlap"].mean().groupby("tracker").mean()
    on_video = video.groupby("tracker")["mean_overlap"].mean()[means.index]
    expected = spearmanr(on_video, means).statistic
    assert agreement == pytest.approx(expected)
    assert -1 <= low <= agreement <= high <= 1


def test_rank_agreement_of_known_orders():
    rng = np.random.default_rng(1)
    levels = np.linspace(0, 1, len(real_video.SCENE_TRACKERS))[:, None]
    video = levels + rng.normal(0, 1e-3, (len(levels), 21))
    same, (low, _) = real_video.rank_agreement(frame_of(video), frame_of(video[:, :4]))
    assert (same, low) == pytest.approx((1, 1))
    opposite, (_, high) = real_video.rank_agreement(frame_of(video), frame_of(-video[:, :4]))
    assert (opposite, high) == pytest.approx((-1, -1))
    noise = rng.normal(size=(len(levels), 8))
    _, (low, high) = real_video.rank_agreement(frame_of(video), frame_of(noise))
    assert low < 0 < high


@pytest.fixture
def recorded(tmp_path):
    """Write two sequences of OTB, in folders of different depth; the second one is grey."""
    rng = np.random.default_rng(0)
    for name, channels in (("a/Deer", 3), ("b/c/Suv", 1)):
        folder = tmp_path / "OTB" / name
        (folder / "img").mkdir(parents=True)
        for n in range(1, 5):
            image = rng.integers(0, 255, (40, 60, channels), np.uint8)
            cv2.imwrite(str(folder / "img" / f"{n:04}.jpg"), image)
        (folder / "groundtruth_rect.txt").write_text(
            "11,11,10,10\n11,11,10,10\n16,11,10,10\n21,11,10,10\n"
        )
    return tmp_path / "OTB"


@pytest.mark.slow
def test_command_runs_missing_runs_and_writes_scores(recorded, tmp_path, monkeypatch, capsys):
    for name in ("TRACKERS", "SCENE_TRACKERS"):
        monkeypatch.setattr(real_video, name, ("static", "camshift"))
    monkeypatch.setattr(real_video, "SEQUENCES", ("Deer", "Suv"))
    monkeypatch.setattr(real_video, "SCENES", ("plain/target:length=10",))
    rows = real_video.measure(recorded, tmp_path / "results", 1).set_index(["tracker", "sequence"])
    assert len(rows) == 6
    static = rows.loc["static"]
    expected = (1 + 1 + 50 / 150 + 0) / 4
    assert static["mean_overlap"][["Deer", "Suv"]].tolist() == pytest.approx([expected] * 2)
    assert static["success_rate"]["Deer"] == 0.5
    assert static["grey"].tolist() == [False, True, False]
    assert static["data"].tolist() == ["OTB", "OTB", "plain"]
    assert not stored.stale_rows(rows.reset_index()).any()
    written = (tmp_path / "results" / "recorded" / "runs.db").read_bytes()
    again = real_video.measure(recorded, tmp_path / "results", 1)
    assert again.equals(rows.reset_index()[again.columns])
    assert len((tmp_path / "results" / "recorded" / "runs.db").read_bytes()) == len(written)


def test_missing_sequences_are_named_together(recorded):
    with pytest.raises(SystemExit, match=r"OTB: Bird1, Bird2, .*, Skiing not found"):
        real_video.find_sequences(recorded)


@pytest.mark.skipif(not SEQUENCES.is_dir(), reason="needs sequences of OTB next to the checkout")
def test_stored_digests_are_those_of_the_sequences(scores):
    digests = scores[scores["data"] == "OTB"].groupby("sequence")["fingerprint"].first()
    folders = real_video.find_sequences(SEQUENCES)
    assert {path.name: datasets.load(path).fingerprint[:16] for path in folders} == {**digests}
