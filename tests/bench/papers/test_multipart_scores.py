"""Stored runs as the paper's tables see them: made by real runs on a short scene."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import bench
import datasets
from bench.experiments.experiment import Experiment, SequenceSource
from bench.papers.multipart import RECORDED
from bench.papers.multipart.scores import adaptive_rows, tidy_scores, without_failures
from bench.papers.multipart.timing import (
    by_representation,
    frame_times,
    kernel_times,
    naive_ratios,
    time_table,
)
from bench.papers.recorded import read_published, shares_of_place_and_size
from bench.papers.timed import failed_passes
from bench.store.files import ResultsError
from bench.store.index import read_index
from bench.store.loading import load_results
from bench.store.results import Results

NAME = "stress/twin:distance=3:scene=1"
TRACKERS = tuple(
    f"multipart:particles=40:representation={which}:init={init}"
    for which in ("single", "multi")
    for init in ("full", "boxes")
)

KERNELS = pd.DataFrame({"single": [1.0, 2.0], "multi": [1.2, 2.4]})


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    experiment = Experiment("twin", TRACKERS, (SequenceSource(NAME),), repetitions=2)
    return bench.run(experiment, tmp_path_factory.mktemp("results"), jobs=1)


def test_every_run_is_a_row_with_its_reading_and_the_knobs_of_its_scene(folder):
    scores = tidy_scores(folder)
    assert len(scores) == 8
    assert set(scores["sequence"]) == {"stress/twin"}
    for column, value in {"scene": 1, "distance": 3.0, "twin": "same", "light": "even"}.items():
        assert set(scores[column]) == {value}
    assert set(scores["variant"]) == {"particles=40"}
    assert sorted(set(scores["initial"])) == ["body", "full"]
    assert set(scores["frames"]) == {150}


def test_counts_hold_the_given_first_frame(folder):
    for _, row in tidy_scores(folder).iterrows():
        run = Results(folder).read(Path(row["path"]))
        native = bench.score(run, NAME)
        assert row["success_frames"] == native["success_frames"] + 1
        assert row["frames_inside"] == native["frames_inside"] + 1
        assert row["first_loss"] == native["first_loss"]
        assert 1 <= row["first_loss"] <= 150


def test_the_distance_of_the_halves_is_that_of_the_rectangle_that_was_drawn(folder):
    from bench.papers.multipart.appearance import part_distance

    sequence = datasets.load(NAME)
    boxes = {"body": sequence.boxes[0], "full": sequence.regions["full"][0]}
    for _, row in tidy_scores(folder).iterrows():
        expected = part_distance(sequence[0], boxes[row["initial"]])
        assert row["part_distance"] == pytest.approx(expected, abs=1e-12)


def test_the_adaptive_rows_are_the_picked_runs(folder):
    scores = tidy_scores(folder)
    adaptive = adaptive_rows(scores)
    assert len(adaptive) == 4
    picked = bench.evaluate("multipart:particles=40:init=boxes", NAME, repetition=1)
    (row,) = (
        row for _, row in adaptive.iterrows() if (row["initial"], row["repetition"]) == ("body", 1)
    )
    stored = Results(folder).read(Path(row["path"]))
    np.testing.assert_array_equal(stored.boxes, picked.boxes)


def test_no_verdict_is_passed_on_what_is_left_of_incomplete_runs(folder):
    results = Results(folder)
    file = results.files()[0]
    kept = file.read_bytes()
    file.unlink()
    try:
        with pytest.raises(ResultsError, match=r"1 of 8 runs are missing.*reproduce"):
            tidy_scores(folder)
    finally:
        file.write_bytes(kept)


def test_runs_that_were_not_asked_for_now_are_left_aside(folder):
    asked = [cell for cell in Results(folder).asked().cells if cell[2] == 0]
    assert len(asked) == 4
    assert set(tidy_scores(folder, asked)["repetition"]) == {0}
    absent = (*asked[0][:2], 7, asked[0][3])
    assert len(tidy_scores(folder, [*asked, absent])) == 4


def test_times_come_from_the_passes_that_no_load_disturbed(tmp_path):
    trackers = tuple(f"multipart:particles=40:representation={w}" for w in ("single", "multi"))
    timing = Experiment("t", trackers, (SequenceSource(NAME),), repetitions=1, timing=True)
    folder = bench.run(timing, tmp_path, jobs=1)
    frames = frame_times(folder)
    assert list(frames.columns) == ["representation", "sequence", "frame", "seconds"]
    clean = load_results(folder).query("disturbed == 0")
    assert len(frames) == 149 * len(clean)
    assert (frames["seconds"] > 0).all()


def test_a_sequence_whose_passes_were_disturbed_has_a_dash_and_spoils_no_ratio():
    both = [("single", 1.0), ("multi", 1.5)]
    rows = [(which, "a", frame, 0.001 * factor) for frame in range(5) for which, factor in both]
    rows += [("single", "b", frame, 0.001) for frame in range(5)]
    frames = pd.DataFrame(rows, columns=["representation", "sequence", "frame", "seconds"])
    table = time_table(frames, KERNELS, np.array([1.1, 1.2]))
    texts = [[cell.text for cell in row] for row in table.rows]
    assert texts == [["a", "1.00", "1.50", "+0.500", "1.500"], ["b", "—", "—", "—", "—"]]
    assert any("1.20 times as long" in note for note in table.notes)
    assert len(by_representation(frames, ["sequence", "frame"])) == 5
    for empty in (frames.iloc[:0], frames[frames["sequence"] == "b"]):
        assert by_representation(empty, ["sequence", "frame"]).empty
        time_table(empty, KERNELS, np.array([1.1, 1.2]))


def test_both_representations_are_weighed_in_turns():
    pairs = kernel_times([NAME])
    assert len(pairs) == 2
    ratios = pairs["multi"] / pairs["single"]
    assert ratios.between(0.3, 3).all()


def test_two_library_calls_a_particle_take_longer_than_one():
    assert np.median(naive_ratios(NAME)) > 1.0


def test_recorded_runs_stand_beside_published_figures_with_the_first_frame_counted(here):
    source = SequenceSource(str(here / "data" / "Small"))
    experiment = RECORDED.experiment([source], 2)
    folder = bench.run(experiment, here / "results", jobs=1)
    figures = here / "figures.csv"
    figures.write_text(
        "eval,scoreset,tracker,sequence,mean_iou_overlapScores,success_at_0.5_from_errorNum\n"
        "OPE,x,CPF,Small,0.5,0.25\nOPE,x,CPF,Other,0.9,0.9\nSRE,x,KMS,Small,0.9,0.9\n"
    )
    table = RECORDED.table(folder, read_published(figures))
    rows = {row[1].text: [cell.text for cell in row[2:]] for row in table.rows}
    assert rows["static"] == ["1.000", "100.0", "1.00", "1.00"]
    assert rows["CPF, published"] == ["0.500", "25.0", "", ""]
    assert "KMS, published" not in rows
    assert "±" in rows["multipart"][0]


def test_what_costs_the_overlap_is_told_apart():
    truth = np.array([[10.0, 20, 40, 60], [50, 20, 40, 60]])
    shifted, shrunk = truth + [20, 0, 0, 0], truth + [10, 15, -20, -30]
    assert shares_of_place_and_size(truth, truth) == pytest.approx((1, 1))
    assert shares_of_place_and_size(truth, shifted) == pytest.approx((1 / 3, 1))
    assert shares_of_place_and_size(truth, shrunk) == pytest.approx((1, 1 / 4))


@pytest.fixture
def with_failures(folder, tmp_path):
    """The results with the runs of the first repetition failed, and a timing run, too."""
    results = Results(Path(shutil.copytree(folder, tmp_path / "failed")))
    for file in results.files():
        run = results.read(file)
        failed = replace(run, failure="frame 3: why\nand where", details={})
        if run.identity.repetition == 0:
            file.unlink()
            assert results.write(failed)
    timed = replace(failed, identity=replace(run.identity, protocol="timing"))
    assert results.write(timed)
    return results.folder


def test_runs_that_failed_are_rows_with_a_reason_and_without_scores(with_failures, folder):
    asked = Results(folder).asked().cells
    scores = tidy_scores(with_failures, asked)
    assert len(scores) == 8
    failed = scores[scores["failure"] != ""]
    assert set(failed["repetition"]) == {0}
    assert failed["first_loss"].isna().all()
    for failure in failed["failure"]:
        assert failure.startswith("multipart:")
        assert failure.endswith(f" on {NAME}, repetition 0: frame 3: why")
    whole = tidy_scores(folder, asked)
    left = scores[scores["failure"] == ""]
    assert left["first_loss"].tolist() == whole[whole["repetition"] == 1]["first_loss"].tolist()
    assert scores["part_distance"].tolist() == whole["part_distance"].tolist()
    assert len(without_failures(scores)) == 0
    assert set(adaptive_rows(scores)["failure"]) <= set(scores["failure"])


def test_timing_runs_that_failed_stand_beneath_the_table(with_failures):
    timed = [
        (row["tracker"], row["sequence"], row["repetition"], row["protocol"])
        for row in read_index(Results(with_failures))
        if row["protocol"] == "timing"
    ]
    (failed,) = failed_passes(with_failures, timed)
    assert failed.endswith("frame 3: why")
    frames = frame_times(with_failures, timed)
    table = time_table(frames, KERNELS, np.array([1.1, 1.2]), [failed])
    assert failed in table.notes
