"""Stored runs as a paper's tables and claims see them: made by real runs on a short scene."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bench
from bench.experiments.experiment import Experiment, SequenceSource
from bench.papers.description import read_description
from bench.papers.recorded import read_published, shares_of_place_and_size
from bench.papers.runs import as_run, tidy_runs
from bench.papers.timing import failed_passes, frame_times, runs_lacking
from bench.store.files import ResultsError
from bench.store.index import read_index
from bench.store.loading import load_results
from bench.store.results import Results

NAME = "plain/target:length=20:scene=1"
TRACKERS = ("particle-filter:particles=15", "particle-filter:particles=15:sigma=0.2")
DESCRIPTION = read_description("wang2010")


def last_overlap(course):
    """What a paper's own Python measures of a run."""
    return {"last_overlap": course.overlap[-1]}


def tidy(folder, cells=None):
    return tidy_runs(folder, cells, DESCRIPTION, {}, last_overlap)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, store_runs):
    made = tmp_path_factory.mktemp("results")
    store_runs(made, TRACKERS, [NAME], repetitions=2)
    return made


def test_every_run_is_a_row_with_its_parameters_and_the_knobs_of_its_scene(folder):
    found = tidy(folder)
    assert found["text"].tolist() == [text for text in TRACKERS for _ in range(2)]
    assert found["repetition"].tolist() == [0, 1] * 2
    assert set(found["sequence"]) == {"plain/target"}
    assert set(found["scene"]) == {1}
    assert set(found["length"]) == set(found["frames"]) == {20}
    assert set(found["particles"]) == {15}
    assert found["sigma"].iloc[2:].tolist() == [0.2] * 2
    assert found["settled"].nunique() == 2


def test_counts_hold_the_given_first_frame_and_measures_are_of_the_run(folder):
    for _, row in tidy(folder).iterrows():
        run = Results(folder).read(Path(row["path"]))
        native = bench.score(run, NAME)
        assert row["success_frames"] == native["success_frames"] + 1
        assert row["frames_inside"] == native["frames_inside"] + 1
        assert row["first_loss"] == native["first_loss"]
        assert 1 <= row["first_loss"] <= 20
        assert 0 <= row["tolerated"] <= 1
        assert row["error_11"] >= 0
        assert 0 <= row["last_overlap"] <= 1


def test_runs_may_stand_for_those_of_other_parameters(folder):
    found = tidy(folder).query("sigma == 0.2")
    copies = as_run(found, radius=10)
    assert copies["copied"].all()
    assert set(copies["text"]) == {"particle-filter:particles=15:radius=10:sigma=0.2"}
    assert set(copies["radius"]) == {10}
    assert copies["first_loss"].tolist() == found["first_loss"].tolist()


def test_no_verdict_is_passed_on_what_is_left_of_incomplete_runs(folder):
    results = Results(folder)
    file = results.files()[0]
    kept = file.read_bytes()
    file.unlink()
    try:
        with pytest.raises(ResultsError, match=r"1 of 4 runs are missing.*reproduce"):
            tidy(folder)
    finally:
        file.write_bytes(kept)


def test_runs_that_were_not_asked_for_now_are_left_aside(folder):
    asked = [cell for cell in Results(folder).asked().cells if cell[2] == 0]
    assert len(asked) == 2
    assert set(tidy(folder, asked)["repetition"]) == {0}
    absent = (*asked[0][:2], 7, asked[0][3])
    assert len(tidy(folder, [*asked, absent])) == 2


def test_times_of_frames_are_those_of_the_runs_warm_and_as_decoded(tmp_path, in_this_process):
    source = (SequenceSource(NAME),)
    timing = Experiment("t", ("static",), source, repetitions=1, timing=True)
    folder = bench.run(timing, tmp_path, jobs=1)
    frames = frame_times(folder)
    assert len(frames) == 19
    assert frames["disturbed"].unique() == load_results(folder)["disturbed"].tolist()
    assert (frames[["seconds", "decoded"]] > 0).all(axis=None)
    (machine, *_) = runs_lacking(folder)
    assert machine.startswith(f"{folder.name}: the reference kernel took ")


def test_recorded_runs_stand_beside_published_figures_with_the_first_frame_counted(
    here, in_this_process
):
    recorded = read_description("multipart").recorded
    recorded = recorded.model_copy(update={"trackers": ("static", "camshift")})
    source = SequenceSource(str(here / "data" / "Small"))
    experiment = recorded.experiment("small", [source], 2)
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


def test_failed_runs_have_a_reason_and_the_worst_scores(with_failures, folder):
    asked = Results(folder).asked().cells
    found = tidy(with_failures, asked)
    assert len(found) == 4
    failed = found[found["failure"] != ""]
    assert set(failed["repetition"]) == {0}
    assert failed[["error_11", "last_overlap"]].isna().all(axis=None)
    assert set(failed["first_loss"]) == set(failed["success_frames"]) == {1.0}
    assert set(failed["mean_overlap"]) == {0.0}
    assert (failed["centre_error"] > 100).all()
    for text, failure in zip(failed["text"], failed["failure"], strict=True):
        assert failure == f"{text} on {NAME}, repetition 0: frame 3: why"
    whole = tidy(folder, asked)
    left = found[found["failure"] == ""]
    assert left["first_loss"].tolist() == whole[whole["repetition"] == 1]["first_loss"].tolist()


def test_timing_runs_that_failed_are_told(with_failures):
    timed = [
        (row["tracker"], row["sequence"], row["repetition"], row["protocol"])
        for row in read_index(Results(with_failures))
        if row["protocol"] == "timing"
    ]
    (failed,) = failed_passes(with_failures, timed)
    assert failed.endswith("frame 3: why")
    assert frame_times(with_failures, timed).empty
