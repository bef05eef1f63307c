"""Results on disk: what is written comes back, damage is named, the index is only a cache."""

import errno
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackmark import bench
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.tracker_spec import contestant, identify
from trackmark.bench.metrics.times import Times
from trackmark.bench.store.asked import Asked
from trackmark.bench.store.checksum import PLACEHOLDER, check, sealed
from trackmark.bench.store.files import ResultsError, _host, write_atomically
from trackmark.bench.store.index import read_index
from trackmark.bench.store.layout import folder_name, run_path
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import read_truth, truth_path, write_truth
from trackmark.bench.store.unfinished import remove_leftovers


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
        times=Times(rng.random(n), rng.random(n), 0.5, 0.25, rng.random(n), rng.random(n)),
    )


def test_a_run_comes_back_as_it_was_written(results, sequence):
    run = full_run(sequence)
    assert results.write(run)
    back = results.read(results.path(run.identity))
    assert_same_run(run, back)
    np.testing.assert_array_equal(run.revised, back.revised)
    assert back.times.initialisation_wall == 0.5
    np.testing.assert_array_equal(run.times.cpu, back.times.cpu)
    np.testing.assert_array_equal(run.times.warm_cpu, back.times.warm_cpu)
    assert back.arrays.keys() == run.arrays.keys()
    np.testing.assert_array_equal(back.arrays[3]["mask"], np.eye(3, dtype=bool))


def test_times_of_before_warm_ones_were_kept_come_back_without(results, sequence):
    run = full_run(sequence)
    old = replace(run, times=replace(run.times, warm_wall=None, warm_cpu=None))
    assert results.write(old)
    back = results.read(results.path(run.identity)).times
    assert back.warm_cpu is None
    np.testing.assert_array_equal(old.times.cpu, back.cpu)


def test_what_lay_beside_an_earlier_run_goes_when_it_is_replaced(results, sequence):
    run = full_run(sequence)
    path = results.path(run.identity)
    assert results.write(run)
    assert len(list(path.parent.iterdir())) == 3
    assert results.write(replace(run, revised=None, arrays={}), run.identity.version)
    assert list(path.parent.iterdir()) == [path]


def test_runs_lie_where_the_contract_says(results, sequence, store):
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


@given(st.binary(), st.binary())
def test_a_seal_fits_its_content_alone(before, after):
    content = sealed(before + PLACEHOLDER.encode() + after)
    check(Path("file"), content)
    with pytest.raises(ResultsError, match="file is damaged"):
        check(Path("file"), content + b"x")


def test_text_that_looks_like_a_seal_is_content(results, sequence):
    run = replace(full_run(sequence), failure=f"{PLACEHOLDER} {sealed(PLACEHOLDER.encode())}")
    assert results.write(run)
    results.read(results.path(run.identity))


def test_a_companion_that_is_gone_is_noticed(results, sequence):
    run = full_run(sequence)
    results.write(run)
    path = results.path(run.identity)
    (companion,) = path.parent.glob("*.npz")
    companion.unlink()
    with pytest.raises(ResultsError, match="npz"):
        results.read(path)


def as_stored(results, run):
    return results.path(run.identity).read_bytes()


def versions(run):
    """The run, as other versions of its tracker would have made it."""
    return [
        replace(run, identity=replace(run.identity, tracker_version={"source": source}))
        for source in "ABC"
    ]


@pytest.mark.parametrize("with_companions", [False, True])
def test_a_late_run_never_replaces_what_another_process_finished(
    results, sequence, with_companions
):
    run = full_run(sequence) if with_companions else bench.evaluate("static", sequence)
    a, b, c = versions(replace(run, failure=""))
    assert results.write(a)
    kept = as_stored(results, a)
    assert not results.write(a), "planned where nothing lay, and late"
    assert not results.write(b)
    assert not results.write(a, replaces=a.identity.version), "finished runs are never repeated"
    assert as_stored(results, a) == kept
    assert results.write(b, replaces=a.identity.version)
    kept = as_stored(results, b)
    assert not results.write(c, replaces=a.identity.version), "what it would replace is gone"
    assert as_stored(results, b) == kept
    results.read(results.path(b.identity))


def test_a_failed_run_gives_way_to_who_saw_it_and_to_any_that_finished(results, sequence):
    failed = full_run(sequence)
    finished = replace(failed, failure="")
    assert results.write(failed)
    assert not results.write(failed)
    assert results.write(failed, replaces=failed.identity.version)
    assert results.write(finished)
    assert results.read(results.path(failed.identity)).status == "finished"
    assert not results.write(failed, replaces=failed.identity.version)


def test_without_hard_links_what_is_there_is_never_replaced_either(results, sequence, monkeypatch):
    def refuse(*_):
        raise PermissionError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr("trackmark.bench.store.files.os.link", refuse)
    run = bench.evaluate("static", sequence)
    assert results.write(run)
    kept = as_stored(results, run)
    assert not results.write(run)
    assert as_stored(results, run) == kept
    full = full_run(sequence)
    assert results.write(full)
    assert not results.write(full)


def test_a_run_of_an_earlier_layout_is_refused_with_what_to_do(results, sequence, store):
    _, path = store(results, sequence)
    parquet.write_table(pa.table({"x": [1.0]}), path)
    with pytest.raises(ResultsError, match=r"0\.parquet has no checksum.*another folder"):
        results.read(path)


def test_a_damaged_truth_is_written_anew(results, sequence, store):
    store(results, sequence)
    path = truth_path(results.folder, sequence.name, sequence.fingerprint)
    path.write_bytes(path.read_bytes()[:50])
    write_truth(results.folder, sequence)
    back = read_truth(results.folder, sequence.name, sequence.fingerprint)
    np.testing.assert_array_equal(back.boxes, sequence.boxes)


@pytest.mark.parametrize("damage", ["[]", "{", '{"schema": 2}', '{"schema": 2, "cells": [[1]]}'])
def test_a_damaged_plan_is_named(results, damage):
    (results.folder / "plan.json").write_text(damage)
    with pytest.raises(ResultsError, match=r"plan\.json (is damaged|has no checksum)"):
        bench.load_results(results.folder)


def test_a_folder_without_results_is_named(tmp_path):
    with pytest.raises(ResultsError, match="there are no results here"):
        bench.load_results(tmp_path)


def test_removing_a_run_takes_its_companions_and_empty_folders(results, sequence):
    run = full_run(sequence)
    results.write(run)
    path = results.path(run.identity)
    results.remove([str(path.relative_to(results.folder))])
    assert not path.parent.parent.exists()


def test_a_missing_truth_file_is_named(results, sequence, store):
    store(results, sequence)
    truth_path(results.folder, sequence.name, sequence.fingerprint).unlink()
    with pytest.raises(ResultsError, match=r"_truth.*missing or damaged"):
        read_index(results)


def test_a_write_that_fails_leaves_the_old_file_and_no_litter(tmp_path, monkeypatch):
    file = tmp_path / "file"
    file.write_text("old")

    def fail(descriptor, content):
        half = len(content) // 2
        if not half:
            raise OSError(errno.ENOSPC, "No space left on device")
        return plain(descriptor, content[:half])

    plain = os.write
    monkeypatch.setattr("trackmark.bench.store.files.os.write", fail)
    with pytest.raises(ResultsError, match="No space left"):
        write_atomically(file, b"new")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    assert file.read_text() == "old"


def test_a_folder_that_is_a_file_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ResultsError, match=r"file/trial/.* can't be written: Not a directory"):
        Results(tmp_path / "file" / "trial").prepare(Asked("", {}))


def test_leftovers_of_processes_that_are_gone_are_removed_and_no_others(tmp_path):
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    host = _host()
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
