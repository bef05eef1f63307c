"""Stored runs as a paper's tables and claims see them: made by real runs on a short scene."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bench
import datasets
from bench.experiments.experiment import Experiment, SequenceSource
from bench.papers import load_paper
from bench.papers.description import read_description
from bench.papers.multipart.measures import of_run, scores
from bench.papers.multipart.scenes import part_distance
from bench.papers.multipart.timing import naive_ratios
from bench.papers.recorded import read_published, shares_of_place_and_size
from bench.papers.runs import tidy_runs
from bench.papers.timing import failed_passes, frame_times
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
DESCRIPTION = read_description("multipart")


def tidy_scores(folder, cells=None):
    return tidy_runs(folder, cells, DESCRIPTION, {}, of_run)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    experiment = Experiment("twin", TRACKERS, (SequenceSource(NAME),), repetitions=2)
    return bench.run(experiment, tmp_path_factory.mktemp("results"), jobs=1)


def test_every_run_is_a_row_with_its_parameters_and_the_knobs_of_its_scene(folder):
    found = tidy_scores(folder)
    assert len(found) == 8
    assert set(found["sequence"]) == {"stress/twin"}
    known = {"scene": 1, "distance": 3.0, "twin": "same", "light": "even", "particles": 40}
    for column, value in known.items():
        assert set(found[column]) == {value}
    assert sorted(set(found["init"])) == ["boxes", "full"]
    assert set(found["frames"]) == {150}


def test_counts_hold_the_given_first_frame(folder):
    for _, row in tidy_scores(folder).iterrows():
        run = Results(folder).read(Path(row["path"]))
        native = bench.score(run, NAME)
        assert row["success_frames"] == native["success_frames"] + 1
        assert row["frames_inside"] == native["frames_inside"] + 1
        assert row["first_loss"] == native["first_loss"]
        assert 1 <= row["first_loss"] <= 150


def test_the_distance_of_the_halves_is_that_of_the_rectangle_that_was_drawn(folder):
    sequence = datasets.load(NAME)
    boxes = {"boxes": sequence.boxes[0], "full": sequence.regions["full"][0]}
    for _, row in tidy_scores(folder).iterrows():
        expected = part_distance(sequence[0], boxes[row["init"]])
        assert row["part_distance"] == pytest.approx(expected, abs=1e-12)


def test_the_proposed_methods_runs_are_copies_of_the_picked_ones(folder):
    found = scores(tidy_scores(folder).assign(copied=False))
    copies = found[found["copied"]]
    assert len(copies) == 4
    assert set(copies["representation"]) == {"adaptive"}
    picked = bench.evaluate("multipart:particles=40:init=boxes", NAME, repetition=1)
    (row,) = copies[(copies["init"] == "boxes") & (copies["repetition"] == 1)].to_dict("records")
    stored = Results(folder).read(Path(row["path"]))
    np.testing.assert_array_equal(stored.boxes, picked.boxes)
    assert row["text"] == "multipart:particles=40"


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
    clean = load_results(folder).query("disturbed == 0")
    assert len(frames) == 149 * len(clean)
    assert (frames["seconds"] > 0).all()


def test_two_library_calls_a_particle_take_longer_than_one():
    assert np.median(naive_ratios(NAME)) > 1.0


def test_recorded_runs_stand_beside_published_figures_with_the_first_frame_counted(here):
    recorded = load_paper("multipart").recorded
    source = SequenceSource(str(here / "data" / "Small"))
    experiment = recorded.experiment([source], 2)
    folder = bench.run(experiment, here / "results", jobs=1)
    figures = here / "figures.csv"
    figures.write_text(
        "eval,scoreset,tracker,sequence,mean_iou_overlapScores,success_at_0.5_from_errorNum\n"
        "OPE,x,CPF,Small,0.5,0.25\nOPE,x,CPF,Other,0.9,0.9\nSRE,x,KMS,Small,0.9,0.9\n"
    )
    table = recorded.table(folder, read_published(figures))
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
    found = tidy_scores(with_failures, asked)
    assert len(found) == 8
    failed = found[found["failure"] != ""]
    assert set(failed["repetition"]) == {0}
    assert failed["first_loss"].isna().all()
    for failure in failed["failure"]:
        assert failure.startswith("multipart:")
        assert failure.endswith(f" on {NAME}, repetition 0: frame 3: why")
    whole = tidy_scores(folder, asked)
    left = found[found["failure"] == ""]
    assert left["first_loss"].tolist() == whole[whole["repetition"] == 1]["first_loss"].tolist()
    # What the proposed method would have picked is not known of these: they stand for it, too.
    copies = scores(found.assign(copied=False)).query("copied and failure != ''")
    assert set(copies["representation"]) == {"adaptive"}
    assert len(copies) == len(failed)


def test_timing_runs_that_failed_are_told(with_failures):
    timed = [
        (row["tracker"], row["sequence"], row["repetition"], row["protocol"])
        for row in read_index(Results(with_failures))
        if row["protocol"] == "timing"
    ]
    (failed,) = failed_passes(with_failures, timed)
    assert failed.endswith("frame 3: why")
    assert frame_times(with_failures, timed).empty
