"""Results on disk: what is written comes back, damage is named, the index is only a cache."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import bench
from bench.contestant import contestant, identify
from bench.record import Run, Times
from bench.store.files import ResultsError, remove_leftovers, write_atomically
from bench.store.index import read_index
from bench.store.results import Asked, Results, folder_name, run_path
from bench.store.truth import read_truth, truth_path, write_truth


@pytest.fixture
def results(tmp_path):
    results = Results(tmp_path / "trial")
    results.prepare(Asked("Trial", {}))
    return results


@pytest.fixture
def sequence(make_sequence):
    return make_sequence(n=12, absent=(4,))


def store(results, sequence, tracker="static", repetition=0):
    run = bench.evaluate(tracker, sequence, repetition)
    write_truth(results.folder, sequence)
    return run, results.write(run)


def assert_same_run(a, b):
    assert a.identity == b.identity
    assert a.failure == b.failure
    np.testing.assert_array_equal(a.boxes, b.boxes)
    np.testing.assert_array_equal(a.visible, b.visible)
    np.testing.assert_array_equal(a.confidence, b.confidence)
    assert a.details.keys() == b.details.keys()
    for key in a.details:
        np.testing.assert_array_equal(a.details[key], b.details[key])


def full_run(sequence):
    n = len(sequence)
    rng = np.random.default_rng(3)
    return Run(
        identity=identify(contestant("static"), sequence, 2, "timing"),
        boxes=rng.normal(size=(n, 4)),
        visible=rng.random(n) > 0.5,
        confidence=rng.random(n),
        details={"half width": rng.random(n), "ünïcode": rng.random(n)},
        failure="frame 3: Error: with\nseveral lines",
        revised=rng.normal(size=(n, 4)),
        arrays={
            3: {"cloud": rng.random((5, 2)), "mask": np.eye(3, dtype=bool)},
            5: {"cloud": np.ones(1)},
        },
        times=Times(rng.random(n), rng.random(n), 0.5, 0.25),
    )


def test_a_run_comes_back_as_it_was_written(results, sequence):
    run = full_run(sequence)
    back = results.read(results.write(run))
    assert_same_run(run, back)
    np.testing.assert_array_equal(run.revised, back.revised)
    assert back.times.initialisation_wall == 0.5
    np.testing.assert_array_equal(run.times.cpu, back.times.cpu)
    assert back.arrays.keys() == run.arrays.keys()
    np.testing.assert_array_equal(back.arrays[3]["mask"], np.eye(3, dtype=bool))


def test_what_lay_beside_an_earlier_run_goes_when_it_is_replaced(results, sequence):
    run = full_run(sequence)
    path = results.write(run)
    assert len(list(path.parent.iterdir())) == 3
    results.write(replace(run, revised=None, arrays={}))
    assert list(path.parent.iterdir()) == [path]


def test_runs_lie_where_the_contract_says(results, sequence):
    _, path = store(results, sequence, "camshift:window=adaptive")
    assert path.relative_to(results.folder).parts == (
        "camshift%3Awindow=adaptive",
        "line",
        "0.parquet",
    )


@given(st.text(min_size=1), st.text(min_size=1))
def test_different_labels_get_different_folders_of_bearable_length(a, b):
    assert (folder_name(a) == folder_name(b)) == (a == b)
    assert len(folder_name(a * 50).encode()) <= 200
    assert "/" not in folder_name(a)


def test_timing_runs_lie_apart_from_scored_ones():
    assert run_path("a", "b", 0, "accuracy") != run_path("a", "b", 0, "timing")


def test_truth_comes_back_as_it_was(results, make_sequence):
    n = 7
    sequence = make_sequence(
        n=n,
        absent=(2,),
        regions={"full": np.ones((n, 4)), "tight": np.zeros((n, 4))},
        visibility=np.linspace(0, 1, n),
        attributes={"occlusion": np.arange(n) > 3},
        fps=12.5,
    )
    write_truth(results.folder, sequence)
    back = read_truth(results.folder, sequence.name, sequence.fingerprint)
    np.testing.assert_array_equal(back.boxes, sequence.boxes)
    np.testing.assert_array_equal(back.visibility, sequence.visibility)
    assert list(back.regions) == ["full", "tight"]
    np.testing.assert_array_equal(back.regions["full"], np.ones((n, 4)))
    assert back.attributes["occlusion"].tolist() == (np.arange(n) > 3).tolist()
    assert back.fps == 12.5


def test_any_flipped_byte_of_a_run_is_noticed_and_the_file_named(results, sequence):
    run, path = store(results, sequence)
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    for position in rng.choice(len(whole), 60, replace=False):
        broken = bytearray(whole)
        broken[position] ^= 0x40
        path.write_bytes(bytes(broken))
        try:
            back = results.read(path)
        except ResultsError as error:
            named = str(error)
        else:  # a byte that means nothing (padding, a writer's name)
            assert_same_run(run, back)
            continue
        assert str(path) in named


def test_a_truncated_run_is_named_with_what_to_do(results, sequence):
    _, path = store(results, sequence)
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(ResultsError, match=r"0\.parquet is damaged .* run the same command again"):
        read_index(results)


def test_results_of_a_newer_layout_are_refused(results):
    plan = results.folder / "plan.json"
    plan.write_text(json.dumps({"schema": 99, "cells": []}))
    with pytest.raises(ResultsError, match="layout version 99"):
        results.prepare(Asked("", {}))


def test_the_index_is_made_anew_when_it_is_lost_damaged_or_old(results, sequence):
    store(results, sequence)
    rows = read_index(results)
    index = results.folder / "index.arrow"
    for damage in (index.unlink, lambda: index.write_bytes(b"rubbish")):
        damage()
        assert read_index(results) == rows
    store(results, sequence, "camshift")
    assert [row["tracker"] for row in read_index(results)] == ["camshift", "static"]
    results.remove(rows[0]["path"])
    assert [row["tracker"] for row in read_index(results)] == ["camshift"]


def test_an_index_that_is_up_to_date_opens_no_run(results, sequence, monkeypatch):
    store(results, sequence)
    rows = read_index(results)
    monkeypatch.setattr(Results, "read", lambda *a: pytest.fail("a run was opened"))
    assert read_index(Results(results.folder)) == rows


def test_scores_in_the_index_are_those_of_the_run(results, sequence):
    run, _ = store(results, sequence)
    (row,) = read_index(results)
    assert {k: v for k, v in row["scores"].items() if v == v} == {
        k: v for k, v in bench.score(run, sequence).items() if v == v
    }


def asked_for(results, *cells):
    results.prepare(Asked("", {cell[:4]: cell[4] for cell in cells}))


def test_load_results_gives_a_row_a_run_and_a_row_for_what_is_missing(results, sequence):
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


def test_runs_of_an_earlier_version_than_was_asked_for_last_are_stale(results, sequence):
    runs = [store(results, sequence, "static", repetition)[0] for repetition in (0, 1)]
    old = runs[0].identity.version
    asked_for(results, *(("static", "line", i, "accuracy", old) for i in (0, 1)))
    assert bench.load_results(results.folder)["status"].tolist() == ["finished"] * 2
    asked_for(results, ("static", "line", 0, "accuracy", "new"))
    assert bench.load_results(results.folder)["status"].tolist() == ["stale"] * 2


def test_a_run_that_was_removed_is_not_missing(results, sequence):
    run, path = store(results, sequence)
    asked_for(results, ("static", "line", 0, "accuracy", run.identity.version))
    results.remove(str(path.relative_to(results.folder)))
    assert len(bench.load_results(results.folder)) == 0


def test_a_damaged_truth_is_written_anew(results, sequence):
    store(results, sequence)
    path = truth_path(results.folder, sequence.name, sequence.fingerprint)
    path.write_bytes(path.read_bytes()[:50])
    write_truth(results.folder, sequence)
    back = read_truth(results.folder, sequence.name, sequence.fingerprint)
    np.testing.assert_array_equal(back.boxes, sequence.boxes)


def test_results_that_can_only_be_read_are_read(results, sequence, monkeypatch):
    store(results, sequence)

    def refuse(path, write):
        raise ResultsError(f"{path} can't be written")

    monkeypatch.setattr("bench.store.index.write_atomically", refuse)
    assert len(read_index(results)) == 1


@pytest.mark.parametrize("damage", ["[]", "{", '{"schema": 1}', '{"schema": 1, "cells": [[1]]}'])
def test_a_damaged_plan_is_named(results, damage):
    (results.folder / "plan.json").write_text(damage)
    with pytest.raises(ResultsError, match=r"plan\.json is damaged"):
        bench.load_results(results.folder)


def test_a_folder_without_results_is_named(tmp_path):
    with pytest.raises(ResultsError, match="there are no results here"):
        bench.load_results(tmp_path)


def test_removing_a_run_takes_its_companions_and_empty_folders(results, sequence):
    path = results.write(full_run(sequence))
    results.remove(str(path.relative_to(results.folder)))
    assert not path.parent.parent.exists()


def test_a_missing_truth_file_is_named(results, sequence):
    store(results, sequence)
    truth_path(results.folder, sequence.name, sequence.fingerprint).unlink()
    with pytest.raises(ResultsError, match=r"_truth.*missing or damaged"):
        read_index(results)


def test_a_write_that_fails_leaves_the_old_file_and_no_litter(tmp_path):
    file = tmp_path / "file"
    file.write_text("old")

    def fail(path):
        path.write_text("half")
        raise OSError(28, "No space left on device")

    with pytest.raises(ResultsError, match="No space left"):
        write_atomically(file, fail)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    assert file.read_text() == "old"


def test_a_folder_that_is_a_file_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ResultsError, match=r"file/trial/plan\.json can't be written"):
        Results(tmp_path / "file" / "trial").prepare(Asked("", {}))


def test_leftovers_of_processes_that_are_gone_are_removed_and_no_others(tmp_path):
    import os
    import socket
    import subprocess
    import sys

    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    host = socket.gethostname()
    dead = tmp_path / f".{host}~{gone.pid}~0.parquet.tmp"
    alive = tmp_path / f".{host}~{os.getpid()}~0.parquet.tmp"
    elsewhere = tmp_path / f".another-{host}~{gone.pid}~0.parquet.tmp"
    for file in (dead, alive, elsewhere):
        file.touch()
    remove_leftovers(tmp_path)
    assert sorted(tmp_path.iterdir()) == sorted([alive, elsewhere])


@pytest.mark.parametrize(
    ("label", "folder"), [("_a.py:T", "%5Fa.py%3AT"), (".", "%2E"), ("a_b", "a_b")]
)
def test_no_run_lies_where_what_is_no_run_lies(label, folder):
    assert folder_name(label) == folder
