"""What was ever asked for: nothing is forgotten, and millions of cells cost megabytes."""

import json
import multiprocessing
import tracemalloc

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackmark.bench.store.asked import Asked, Cells, add_asked, read_asked, withdraw
from trackmark.bench.store.columns import coded
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import run_path

CELL = st.tuples(
    st.sampled_from(["a", "b:c=1"]),
    st.sampled_from(["s", "t/u", "_v"]),
    st.integers(0, 4),
    st.sampled_from(["accuracy", "timing"]),
)
CELLS = st.lists(CELL, unique=True, max_size=12)


def asked(cells, version="1", title=""):
    return Asked(title, dict.fromkeys(cells, version))


@given(CELLS)
def test_what_is_asked_for_comes_back_in_its_order(tmp_path_factory, cells):
    folder = tmp_path_factory.mktemp("asked")
    add_asked(folder, asked(cells, title="Ünïcode"))
    back = read_asked(folder)
    assert list(back.cells) == cells
    assert dict(back.cells) == dict.fromkeys(cells, "1")
    assert back.title == "Ünïcode"
    assert all(cell in back.cells for cell in cells)
    assert ("no", "s", 0, "accuracy") not in back.cells


@given(CELLS, CELLS)
def test_the_later_version_of_a_series_counts_for_all_its_repetitions(first, second):
    both = asked(first, "1", "First").and_then(asked(second, "2"))
    series = {(t, s, p) for t, s, _, p in second}
    assert list(both.cells) == list(dict.fromkeys([*first, *second]))
    for (t, s, r, p), version in both.cells.items():
        assert version == ("2" if (t, s, p) in series else "1"), (t, s, r, p)
    assert both.title == "First"


@given(CELLS, CELLS)
def test_what_is_withdrawn_is_gone_and_nothing_else(tmp_path_factory, cells, gone):
    folder = tmp_path_factory.mktemp("asked")
    add_asked(folder, asked(cells))
    withdraw(folder, [str(run_path(*cell)) for cell in gone])
    assert list(read_asked(folder).cells) == [cell for cell in cells if cell not in gone]


def test_the_same_asked_for_again_leaves_the_file_alone(tmp_path):
    wanted = asked([("a", "s", i, "accuracy") for i in range(5)])
    add_asked(tmp_path, wanted)
    before = (tmp_path / "plan.json").stat()
    add_asked(tmp_path, wanted)
    after = (tmp_path / "plan.json").stat()
    assert (before.st_mtime_ns, before.st_ino) == (after.st_mtime_ns, after.st_ino)


def add_some(folder, worker):
    for i in range(10):
        add_asked(folder, asked([(f"t{worker}", "s", i, "accuracy")]))


def test_two_that_ask_at_once_forget_nothing(tmp_path):
    context = multiprocessing.get_context("spawn")
    others = [context.Process(target=add_some, args=(tmp_path, worker)) for worker in range(2)]
    for process in others:
        process.start()
    for process in others:
        process.join()
    assert len(read_asked(tmp_path).cells) == 20


@pytest.mark.parametrize(
    "change",
    [
        lambda plan: plan["series"]["count"].append(1),
        lambda plan: plan["series"]["count"].__setitem__(0, 0),
        lambda plan: plan["series"]["tracker"].__setitem__(0, 7),
        lambda plan: plan["series"].pop("first"),
        lambda plan: plan["names"].pop("version"),
    ],
)
def test_a_file_that_does_not_fit_together_is_named(tmp_path, monkeypatch, change):
    add_asked(tmp_path, asked([("a", "s", 0, "accuracy")]))
    file = tmp_path / "plan.json"
    plan = json.loads(file.read_text())
    change(plan)
    file.write_text(json.dumps(plan))
    monkeypatch.setattr("trackmark.bench.store.asked.check", lambda *_: None)  # whole, but wrong
    with pytest.raises(ResultsError, match=r"plan\.json is damaged"):
        read_asked(tmp_path)


def test_the_plan_of_an_earlier_layout_is_refused(tmp_path):
    (tmp_path / "plan.json").write_text('{"schema": 1, "title": "", "cells": []}')
    with pytest.raises(ResultsError, match="layout version 1"):
        read_asked(tmp_path)


def test_a_cell_costs_some_hundred_bytes_at_most_though_each_series_has_one(tmp_path):
    trackers, sequences = 100, 200
    n = trackers * sequences
    table = pa.table(
        {
            "tracker": coded([f"t{i}" for i in range(trackers)], np.arange(n) % trackers),
            "sequence": coded([f"s{i}" for i in range(sequences)], np.arange(n) // trackers),
            "protocol": coded(["accuracy"], np.zeros(n)),
            "version": coded([f"{i:016x}" for i in range(n)], np.arange(n)),
            "repetition": np.zeros(n, np.int32),
        }
    )
    many = Asked("many", Cells(table))
    tracemalloc.start()
    arrow = pa.total_allocated_bytes()
    try:
        add_asked(tmp_path, many)
        add_asked(tmp_path, Asked("", {("t0", "s0", 1, "accuracy"): "new"}))
        back = read_asked(tmp_path)
        spent = tracemalloc.get_traced_memory()[1] + pa.total_allocated_bytes() - arrow
    finally:
        tracemalloc.stop()
    assert len(back.cells) == n + 1
    assert spent < 500 * n
