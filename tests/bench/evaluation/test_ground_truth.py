"""Runs that start from a region of the ground truth and are scored against it."""

import numpy as np
import pytest

import trackmark as tm
from tests.bench.stored_truths import add_truth_of
from trackmark.bench.evaluation.loop import evaluate_run, run_protocol
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.pages.player_runs import collect_runs
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.runs import Runs
from trackmark.datasets import Sequence, SequenceError

N = 6


@pytest.fixture
def sequence():
    rng = np.random.default_rng(3)
    images = list(rng.integers(0, 256, (N, 60, 80, 3), dtype=np.uint8))
    steps = np.arange(N)[:, None] * [2.0, 1.0, 0.0, 0.0]
    upper = steps + [20.0, 12.0, 10.0, 8.0]
    whole = steps + [18.0, 10.0, 14.0, 30.0]
    late = whole.copy()
    late[0] = np.nan
    return Sequence("person", images, upper, fingerprint="f", regions={"full": whole, "late": late})


def test_run_starts_from_the_region_of_its_spec(sequence):
    run = evaluate_run("static:init=full", sequence)
    np.testing.assert_array_equal(run.boxes, np.tile(sequence.regions["full"][0], (N, 1)))
    assert run.identity.init == "full"
    assert run.identity.tracker == "static:init=full"


def test_run_is_scored_by_the_region_of_its_start(sequence):
    run = evaluate_run("static:init=full", sequence)
    by_hand = tm.score(
        run.boxes, Sequence("p", sequence.frames, sequence.regions["full"], fingerprint="g")
    )
    scores = tm.score(run, sequence)
    assert scores["mean_overlap"] == by_hand["mean_overlap"]
    assert scores["centre_error"] == by_hand["centre_error"]
    plain = tm.score(evaluate_run("static", sequence), sequence)
    assert plain["mean_overlap"] != scores["mean_overlap"]


def test_region_changes_identity_but_not_seed(sequence):
    plain, full = parse_tracker("static"), parse_tracker("static:init=full")
    runs = run_protocol([(plain, 0), (full, 0)], sequence).runs
    assert runs[0].identity.version != runs[1].identity.version
    assert plain.name == full.name == "static"
    assert parse_tracker("static:init=boxes").label == "static"


def test_unknown_region_is_named_with_the_known_ones(sequence):
    for region, hint in (("ful", r"Did you mean 'full'\?"), ("xyz", "Known: boxes, full, late")):
        with pytest.raises(SequenceError, match=f"person has no region '{region}' .*{hint}"):
            evaluate_run(f"static:init={region}", sequence)


def test_region_absent_in_first_target_frame_is_rejected(sequence):
    with pytest.raises(SequenceError, match="'late' is absent in frame 0"):
        evaluate_run("static:init=late", sequence)


def test_stored_runs_are_scored_and_plotted_by_their_region(sequence, tmp_path):
    results = RunStore(tmp_path / "trial")
    runs = [evaluate_run(text, sequence) for text in ("static", "static:init=full")]
    results.add_requests({}, "trial")
    add_truth_of(results.folder, sequence)
    for run in runs:
        results.add(run)
    opened = Runs.open(results.folder)
    stored = opened.table.set_index("tracker")
    page = collect_runs(opened.read(opened.evaluated_rows()), [])
    (sequence_runs,) = page.sequences
    drawn = {page.trackers[entry.tracker]: entry.overlaps for entry in sequence_runs.one_pass}
    for run in runs:
        expected = tm.score(run, sequence)["mean_overlap"]
        assert stored.loc[run.identity.tracker, "mean_overlap"] == expected
        assert np.nanmean(drawn[run.identity.tracker]) == pytest.approx(expected, abs=1e-6)
