"""The index: a cache of the folder that is never wrong, and what is read out of it."""

import os

import numpy as np
import pytest

from trackmark import bench
from trackmark.bench.store import index
from trackmark.bench.store.asked import Asked
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.index import (
    GrowingIndex,
    index_row,
    index_table,
    list_runs,
    read_index,
    read_table,
)
from trackmark.bench.store.layout import run_path
from trackmark.bench.store.results import Results


def asked_for(results, *cells):
    results.prepare(Asked("", {cell[:4]: cell[4] for cell in cells}))


def test_the_index_is_made_anew_when_it_is_lost_damaged_or_old(results, sequence, store):
    store(results, sequence)
    rows = read_index(results)
    index = results.folder / "index.arrow"
    for damage in (index.unlink, lambda: index.write_bytes(b"rubbish")):
        damage()
        assert read_index(results) == rows
    store(results, sequence, "camshift")
    assert [row["tracker"] for row in read_index(results)] == ["camshift", "static"]
    results.remove([rows[0]["path"]])
    assert [row["tracker"] for row in read_index(results)] == ["camshift"]


def test_an_index_that_is_up_to_date_opens_no_run(results, sequence, monkeypatch, store):
    store(results, sequence)
    rows = read_index(results)
    monkeypatch.setattr(Results, "read", lambda *a: pytest.fail("a run was opened"))
    assert read_index(Results(results.folder)) == rows


def test_a_trackers_own_version_is_a_column_also_where_an_older_index_lacks_it(
    results, sequence, make_sequence, store
):
    store(results, sequence)
    store(results, make_sequence(name="other"))
    table = read_table(results)
    assert len(set(table["version"].to_pylist())) == 2
    assert len(set(table["tracker_version"].to_pylist())) == 1
    index._write_index(results, table.drop_columns("tracker_version"))
    assert read_table(results)["tracker_version"].equals(table["tracker_version"])
    frame = bench.load_results(results.folder)
    assert frame.groupby(["tracker", "tracker_version"], observed=True).size().tolist() == [2]


def test_scores_in_the_index_are_those_of_the_run(results, sequence, store):
    run, _ = store(results, sequence)
    (row,) = read_index(results)
    assert {k: v for k, v in row["scores"].items() if v == v} == {
        k: v for k, v in bench.score(run, sequence).items() if v == v
    }


def test_load_results_gives_a_row_a_run_and_a_row_for_what_is_missing(results, sequence, store):
    run, _ = store(results, sequence)
    asked_for(
        results,
        ("static", "line", 0, "accuracy", run.identity.version),
        ("gone", "line", 0, "accuracy", "v"),
    )
    table = bench.load_results(results.folder)
    assert table.set_index("tracker")["status"].to_dict() == {
        "static": "finished",
        "gone": "missing",
    }
    assert bench.load_results(results.folder.parent).equals(table)
    assert table["experiment"].unique().tolist() == ["trial"]


def test_what_was_asked_for_is_not_forgotten_when_something_else_is(results, sequence):
    asked_for(results, ("a", "line", 0, "accuracy", "1"), ("a", "line", 1, "accuracy", "1"))
    asked_for(results, ("b", "line", 0, "accuracy", "1"))
    assert bench.load_results(results.folder)["tracker"].tolist() == ["a", "a", "b"]


def test_runs_of_an_earlier_version_than_was_asked_for_last_are_stale(results, sequence, store):
    runs = [store(results, sequence, "static", repetition)[0] for repetition in (0, 1)]
    old = runs[0].identity.version
    asked_for(results, *(("static", "line", i, "accuracy", old) for i in (0, 1)))
    assert bench.load_results(results.folder)["status"].tolist() == ["finished"] * 2
    asked_for(results, ("static", "line", 0, "accuracy", "new"))
    assert bench.load_results(results.folder)["status"].tolist() == ["stale"] * 2


def test_a_run_that_was_removed_is_not_missing(results, sequence, store):
    run, path = store(results, sequence)
    asked_for(results, ("static", "line", 0, "accuracy", run.identity.version))
    results.remove([str(path.relative_to(results.folder))])
    assert len(bench.load_results(results.folder)) == 0


def test_results_that_can_only_be_read_are_read(results, sequence, monkeypatch, store):
    store(results, sequence)

    def refuse(path, content):
        raise ResultsError(f"{path} can't be written")

    monkeypatch.setattr("trackmark.bench.store.index.write_atomically", refuse)
    assert len(read_index(results)) == 1


def names(results):
    return [(row["tracker"], row["repetition"]) for row in read_index(results)]


def test_rows_stand_in_the_order_of_the_files_whenever_they_came(results, sequence, store):
    for tracker, repetition in (("static", 10), ("static", 2), ("camshift", 0), ("static", 0)):
        store(results, sequence, tracker, repetition)
        read_index(results)
    expected = [("camshift", 0), ("static", 0), ("static", 2), ("static", 10)]
    assert names(results) == expected
    (results.folder / "index.arrow").unlink()
    assert names(results) == expected


def test_only_files_that_changed_are_opened(results, sequence, monkeypatch, store):
    paths = [store(results, sequence, "static", i)[1] for i in range(3)]
    read_index(results)
    opened = []
    plain = Results.read
    monkeypatch.setattr(
        Results, "read", lambda self, path: opened.append(path) or plain(self, path)
    )
    status = paths[1].stat()
    os.utime(paths[1], ns=(status.st_atime_ns, status.st_mtime_ns + 1))
    paths[2].unlink()
    assert names(results) == [("static", 0), ("static", 1)]
    assert opened == [paths[1]]


def test_an_index_of_other_scores_is_made_anew(results, sequence, monkeypatch, store):
    store(results, sequence)
    rows = read_index(results)
    monkeypatch.setattr(index, "_scorer_version", lambda: b"another")
    monkeypatch.setattr("trackmark.bench.store.index.score_both", lambda run, truth: {"new": 1.0})
    (row,) = read_index(results)
    assert row["scores"] == {"new": 1.0}
    assert rows[0]["scores"] != row["scores"]


def test_an_index_of_another_folder_is_not_believed(results, sequence, tmp_path, store):
    store(results, sequence)
    read_index(results)
    other = Results(tmp_path / "other")
    other.prepare(Asked("", {}))
    store(other, sequence, "camshift")
    whole = (results.folder / "index.arrow").read_bytes()
    (other.folder / "index.arrow").write_bytes(whole)
    assert names(other) == [("camshift", 0)]


def test_a_score_that_a_run_has_not_is_null_and_one_without_a_value_is_nan(
    results, make_sequence, store
):
    store(results, make_sequence(n=8))
    (row,) = read_index(results)
    assert np.isnan(row["scores"]["absence_reported"])
    bare = index_table([row, {**row, "repetition": 1, "scores": {}}])
    assert bare["absence_reported"].null_count == 1
    assert bare["absence_reported"][1].as_py() is None


def test_files_that_are_no_runs_are_left_aside_or_named(results, sequence, store):
    _, path = store(results, sequence)
    (path.parent / ".hidden.parquet.tmp").touch()
    (results.folder / "_truth" / "x").mkdir()
    assert len(list_runs(results.folder)) == 1
    (path.parent / "copy of 0.parquet").touch()
    with pytest.raises(ResultsError, match=r"copy of 0\.parquet is called like no run"):
        read_table(results)


def test_a_growing_index_is_on_disk_when_it_is_written(results, sequence, monkeypatch, store):
    growing = GrowingIndex(results)
    for repetition in (0, 1):
        run, path = store(results, sequence, "static", repetition)
        growing.add([index_row(results, path, run, sequence)])
    growing.write()
    monkeypatch.setattr(Results, "read", lambda *a: pytest.fail("a run was opened"))
    assert names(results) == [("static", 0), ("static", 1)]


def test_a_run_that_was_made_again_has_one_row(results, sequence, store):
    run, path = store(results, sequence)
    row = index_row(results, path, run, sequence)
    table = index._with_rows(index_table([row]), [index_table([{**row, "failure": "later"}])])
    assert table["failure"].to_pylist() == ["later"]


def test_text_in_a_frame_of_results_takes_a_number_a_run(results, sequence, store):
    run, _ = store(results, sequence)
    asked_for(results, *(("static", "line", i, "accuracy", run.identity.version) for i in range(9)))
    frame = bench.load_results(results.folder)
    assert len(frame) == 9
    assert (frame["status"] == "missing").sum() == 8
    for column in ("tracker", "sequence", "status", "failure", "parameters"):
        assert frame[column].dtype == "category", column
    row = frame.iloc[0]
    path = run_path(row["tracker"], row["sequence"], row["repetition"], row["protocol"])
    assert (results.folder / path).is_file()
