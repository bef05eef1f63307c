"""Builders of runs and results that several tests share."""

from dataclasses import replace

import numpy as np
import pytest

from tests.bench.stored_truths import add_truth_of
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.tracker_spec import parse_tracker, run_identity
from trackmark.bench.metrics.times import Times
from trackmark.bench.store.database import run_key
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.runs import Runs


def of_version(run, source):
    """Return the run with another version of its tracker."""
    return replace(run, identity=replace(run.identity, tracker_code={"source": source}))


def full_run(sequence, repetition=2):
    """Return a failed timing run with all optional parts."""
    n = len(sequence)
    rng = np.random.default_rng(3)
    return Run(
        identity=run_identity(parse_tracker("static"), sequence, repetition, "timing"),
        boxes=rng.normal(size=(n, 4)),
        visible=rng.random(n) > 0.5,
        confidence=rng.random(n),
        details={"half width": rng.random(n), "ünïcode/": rng.random(n)},
        failure="frame 3: Error: with\nseveral lines",
        tracker_output="\ud800 is no character",
        revised=rng.normal(size=(n, 4)),
        arrays={
            3: {"cloud": rng.random((5, 2)), "mask": np.eye(3, dtype=bool)},
            5: {"cloud/x": np.ones(1), "number": np.array(7), "none": np.empty((0, 2))},
        },
        times=Times(*rng.random((4, n)), np.arange(n) == 0, np.array([0.5])),
        states=np.arange(n, dtype=np.int32),
        estimate_frames=np.arange(n, dtype=np.int32),
        segments=(np.arange(5, dtype=np.int32), np.arange(n - 5, dtype=np.int32)),
        metadata={"seconds": 1.5, "reading_seconds": np.nan},
    )


def request(results, *runs, title="Trial"):
    """Store the request of these runs."""
    results.add_requests({run_key(r.identity): r.identity.version for r in runs}, title)


@pytest.fixture
def results(tmp_path):
    """Return results without runs."""
    results = RunStore(tmp_path / "trial")
    results.add_requests({}, "Trial")
    return results


@pytest.fixture
def sequence(make_sequence):
    """Return a short sequence whose target is absent once."""
    return make_sequence(n=12, absent=(4,))


@pytest.fixture
def store():
    """Return a function that evaluates a tracker, stores the run and returns it."""

    def stored(results, sequence, tracker="static", repetition=0):
        run = evaluate_run(tracker, sequence, repetition)
        add_truth_of(results.folder, sequence)
        assert results.add(run)
        return run

    return stored


@pytest.fixture
def several(results, sequence, store):
    """Return results with rows in every table."""
    runs = [store(results, sequence, "static", repetition) for repetition in range(3)]
    runs.append(full_run(sequence))
    assert results.add(runs[-1])
    request(results, *runs)
    Runs.open(results.folder)  # stores the scores
    return results
