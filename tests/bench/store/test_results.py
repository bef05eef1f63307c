"""Tests of the results store: runs are read back unchanged and finished runs are kept."""

import sqlite3
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays, scalar_dtypes

import trackmark as tm
from tests.bench.store.conftest import full_run, of_version, request
from tests.bench.stored_truths import add_truth_of
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.store import run_store
from trackmark.bench.store import runs as runs_module
from trackmark.bench.store.database import ResultsError, pack, run_key, unpack
from trackmark.bench.store.maintenance import find_damage, merge_results
from trackmark.bench.store.run_rows import run_row
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.runs import Runs, list_runs, store_scores
from trackmark.bench.store.truth import read_truth
from trackmark.datasets.shapes import EncodedMask, Shapes

CELL = st.tuples(
    st.sampled_from(["a", "b:c=1"]),
    st.sampled_from(["s", "t/u", "_v"]),
    st.integers(0, 4),
    st.sampled_from(["one-pass", "timing"]),
)
CELLS = st.lists(CELL, unique=True, max_size=12)


def assert_same(a, b):
    """Compare values and nested arrays bit by bit."""
    assert type(a) is type(b)
    if isinstance(a, np.ndarray):
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)
    elif isinstance(a, dict):
        assert a.keys() == b.keys()
        for key in a:
            assert_same(a[key], b[key])
    elif isinstance(a, tuple):
        assert len(a) == len(b)
        for first, second in zip(a, b, strict=True):
            assert_same(first, second)
    elif hasattr(a, "run_delay"):
        assert_same(vars(a), vars(b))
    else:
        assert a == b


@pytest.mark.parametrize("change", [{}, {"times": None, "revised": None, "arrays": {}}])
def test_run_is_read_unchanged(results, sequence, change):
    run = replace(full_run(sequence), **change)
    assert results.add(run)
    back = results.read(run_key(run.identity))
    for field in fields(run):
        if field.name not in ("metadata", "tracker_output"):
            assert_same(getattr(run, field.name), getattr(back, field.name))
    assert back.metadata["seconds"] == 1.5
    assert {"date", "host", "libraries"} <= back.metadata.keys()
    assert back.tracker_output == "\\ud800 is no character"
    assert not back.boxes.flags.writeable


@given(st.dictionaries(st.text(), arrays(scalar_dtypes(), array_shapes(min_dims=0)), max_size=3))
def test_arrays_are_unpacked_unchanged(named):
    back = unpack(pack(named))
    assert list(back) == list(named)
    for name, values in named.items():
        assert (back[name].dtype, back[name].shape) == (values.dtype, values.shape)
        assert back[name].tobytes() == values.tobytes()


def test_ground_truth_is_read_unchanged(results, make_sequence):
    n, polygon = 7, np.array([[1.5, 2], [9.1, 2], [9, 8], [0.1, 7]])
    mask = EncodedMask(3, 4, 5, 2, np.array([2, 5, 3]))
    sequence = make_sequence(
        n=n,
        absent=(2,),
        annotated=np.arange(n) != 5,
        regions={"full": np.ones((n, 4)), "tight": np.zeros((n, 4))},
        visibility=np.linspace(0, 1, n),
        attributes={"occlusion": np.arange(n) > 3},
        fps=12.5,
        shapes=Shapes({0: polygon, 1: mask}, range(n), (32, 24)),
    )
    add_truth_of(results.folder, sequence)
    back = read_truth(results.folder, sequence.name, sequence.fingerprint)
    assert_same(dict(back.regions), dict(sequence.regions))
    assert_same(dict(back.attributes), dict(sequence.attributes))
    np.testing.assert_array_equal(back.boxes, sequence.boxes)
    np.testing.assert_array_equal(back.annotated, sequence.annotated)
    np.testing.assert_array_equal(back.visibility, sequence.visibility)
    assert (back.fps, back.image_size) == (12.5, sequence.image_size)
    for ours, theirs in zip(back.shapes, sequence.shapes, strict=True):
        np.testing.assert_array_equal(ours, theirs)


@given(CELLS, CELLS, CELLS)
def test_manifest_keeps_order_and_latest_versions(tmp_path_factory, first, second, gone):
    results = RunStore(tmp_path_factory.mktemp("asked"))
    results.add_requests(dict.fromkeys(first, "1"), "First")
    results.add_requests(dict.fromkeys(second, "2"))
    series = {(t, s, p) for t, s, _, p in second}
    expected = {
        (t, s, r, p): "2" if (t, s, p) in series else "1"
        for t, s, r, p in dict.fromkeys([*first, *second])
    }
    runs = Runs.unscored(results.folder)
    assert (runs.title, list(runs.requested.items())) == ("First", list(expected.items()))
    results.remove(gone)
    assert list(Runs.unscored(results.folder).requested) == [
        cell for cell in expected if cell not in gone
    ]
    assert find_damage(results.folder) == []


def test_repeated_request_does_not_write(several):
    before = (several.folder / "runs.db").read_bytes()
    several.add_requests(Runs.unscored(several.folder).requested, "Trial")
    assert (several.folder / "runs.db").read_bytes() == before


def test_too_many_requests_are_refused(results, monkeypatch):
    monkeypatch.setattr("trackmark.bench.store.run_store.MAX_RUNS", 3)
    cells = {("a", "s", i, "one-pass"): "1" for i in range(4)}
    with pytest.raises(ResultsError, match=r"4 runs are requested .* at most 3\. .* --name"):
        results.add_requests(cells)


def test_late_run_never_replaces_a_finished_run(results, sequence):
    run = replace(full_run(sequence), failure="")
    a, b, c = (of_version(run, source) for source in "ABC")
    cell = run_key(run.identity)
    assert results.add(a)
    assert not results.add(a), "planned when nothing was stored, and late"
    assert not results.add(b)
    assert not results.add(a, replaced_version=a.identity.version), (
        "finished runs are never repeated"
    )
    assert results.read(cell).identity == a.identity
    assert results.add(b, replaced_version=a.identity.version)
    assert not results.add(c, replaced_version=a.identity.version), "the run to replace is gone"
    assert results.read(cell).identity == b.identity


def test_failed_run_is_replaced_by_planned_or_finished_run(results, sequence):
    failed = full_run(sequence)
    assert results.add(failed)
    assert not results.add(failed)
    assert results.add(failed, replaced_version=failed.identity.version)
    assert results.add(replace(failed, failure=""))
    assert results.read(run_key(failed.identity)).status == "finished"
    assert not results.add(failed, replaced_version=failed.identity.version)


def test_write_all_is_atomic(results, sequence):
    run = evaluate_run("static", sequence)
    broken = replace(evaluate_run("static", sequence, 1), metadata={"host": object()})
    with pytest.raises(TypeError):
        results.add_all([(run, ""), (broken, "")])
    assert results.list_keys() == []


def test_rows_have_the_scores_of_their_runs_and_are_ordered(results, sequence, store):
    keys = [("static", 10), ("static", 2), ("camshift", 0), ("static", 0)]
    runs = {key: store(results, sequence, *key) for key in keys}
    rows = Runs.open(results.folder).stored_rows
    assert [(row["tracker"], row["repetition"]) for row in rows] == sorted(keys)
    for row in rows:
        run = runs[row["tracker"], row["repetition"]]
        truth = read_truth(results.folder, sequence.name, sequence.fingerprint)
        assert repr(row) == repr(run_row(results.read(run_key(row)), truth))
        expected = tm.score(run, sequence)
        assert {k: v for k, v in row["scores"].items() if v == v} == {
            k: v for k, v in expected.items() if v == v
        }


def test_run_is_scored_once_per_version_of_the_scores(results, sequence, store, monkeypatch):
    run = store(results, sequence)
    rows = Runs.open(results.folder).stored_rows
    with monkeypatch.context() as patch:
        patch.setattr(RunStore, "read", lambda *a: pytest.fail("a run was opened"))
        assert repr(Runs.open(results.folder).stored_rows) == repr(rows)
    for module in (runs_module, run_store):
        monkeypatch.setattr(module, "scorer_version", lambda: "another")
    monkeypatch.setattr(runs_module, "score_both", lambda run, truth: {"new": 1.0})
    assert [row["scores"] for row in Runs.open(results.folder).stored_rows] == [{"new": 1.0}]
    newer = of_version(run, "newer")
    assert results.add(newer, run.identity.version)
    store_scores(
        results.folder, [{**rows[0], "scores": {"late": 1.0}}]
    )  # of the run that was replaced
    assert [row["scores"] for row in Runs.open(results.folder).stored_rows] == [{"new": 1.0}]


def test_data_frame_has_stored_missing_and_stale_runs(results, sequence, store):
    run, other = store(results, sequence), store(results, sequence, "camshift")
    later = of_version(other, "later")
    gone = evaluate_run("static", sequence, 1)
    request(results, later, gone, run)
    frame = Runs.open(results.folder).table
    assert frame["tracker"].tolist() == ["camshift", "static", "static"]
    assert frame["status"].tolist() == ["stale", "finished", "missing"]
    for column in ("tracker", "sequence", "status", "failure", "parameters"):
        assert frame[column].dtype == object, column
    assert frame["mean_overlap"].notna().tolist() == [False, True, False]  # no score of a stale run
    chosen = Runs.open(results.folder).select([run_key(run.identity)]).table
    assert chosen["repetition"].tolist() == [0]


def test_removed_runs_are_neither_stored_nor_missing(several, sequence):
    several.remove([cell for cell in several.list_keys() if cell[2] != 1])
    assert Runs.open(several.folder).table["repetition"].tolist() == [1]
    assert find_damage(several.folder) == []
    several.remove(several.list_keys())
    with pytest.raises(ResultsError, match="no ground truth of line"):
        read_truth(several.folder, sequence.name, sequence.fingerprint)
    assert len(Runs.open(several.folder).table) == 0


def test_merged_results_are_those_of_all_sources(several, sequence, store, tmp_path):
    other = RunStore(tmp_path / "other")
    run = store(other, sequence, "camshift")
    request(other, run, title="")
    target = tmp_path / "deep" / "target"
    assert merge_results([several.folder, other.folder], target) == (5, [])
    assert merge_results([other.folder], target) == (0, [])
    assert RunStore(target).list_keys() == sorted([*other.list_keys(), *several.list_keys()])
    assert Runs.unscored(target).title == "Trial"
    assert find_damage(target) == []
    newer = RunStore(tmp_path / "newer")
    add_truth_of(newer.folder, sequence)
    newer.add(of_version(run, "newer"))
    copied, (conflict,) = merge_results([newer.folder], target)
    assert copied == 0
    assert "camshift on line, repetition 0, differs between" in conflict


def test_columns_are_readable_without_trackmark(several):
    with sqlite3.connect(several.folder / "runs.db") as database:
        query = "SELECT tracker, status, frames, seconds FROM run ORDER BY id"
        *_, last = database.execute(query)
        assert last == ("static", "failed", 12, 1.5)
    database.close()


def test_missing_results_and_runs_are_named(several, sequence, tmp_path):
    with pytest.raises(ResultsError, match=r"this folder contains no results"):
        Runs.open(tmp_path / "nothing")
    similar = several.folder.name + "s"
    with pytest.raises(ResultsError, match=f"Did you mean '{several.folder.name}'"):
        Runs.open(several.folder.with_name(similar))
    with pytest.raises(ResultsError, match=r"runs\.db has no run of static on line, repetition 9"):
        several.read(("static", "line", 9, "one-pass"))
    (tmp_path / "file").write_text("")
    with pytest.raises(ResultsError, match=r"file/trial/runs\.db cannot be written"):
        RunStore(tmp_path / "file" / "trial").add_requests({})
    assert list_runs(tmp_path / "new") == []
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("PRAGMA application_id = 5", "not a file of trackmark: its application id is 0x5"),
        ("PRAGMA user_version = 4", "schema version 4; this version of trackmark reads 5"),
        ("DROP TABLE score", "is damaged: its tables do not have the expected columns"),
    ],
)
def test_other_files_are_refused(several, change, message):
    database = sqlite3.connect(several.folder / "runs.db")
    database.execute(change)
    database.commit()
    database.close()
    with pytest.raises(ResultsError, match=message) as error:
        Runs.open(several.folder)
    assert str(several.folder / "runs.db") in str(error.value)


def test_timing_run_is_replaced_by_a_less_disturbed_one(results, sequence):
    def timed(share, protocol="timing"):
        run = replace(full_run(sequence), failure="")
        identity = replace(run.identity, protocol=protocol)
        return replace(run, identity=identity, metadata={"run_delay_share": share})

    assert results.add(timed(0.4))
    assert not results.add(timed(0.5))
    assert results.add(timed(0.2))
    (key,) = results.list_keys()
    assert results.read(key).metadata["run_delay_share"] == 0.2
    assert results.add(timed(0.4, "one-pass"))
    assert not results.add(timed(0.2, "one-pass"))
