"""Hostile trackers fail only their own runs; other runs stay equal to the bit."""

import os
import re
import runpy
import warnings
from contextlib import closing
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.bench.engine import hostile, hostile_answers
from trackmark import bench, datasets
from trackmark.bench.engine.pool import Pool
from trackmark.bench.engine.work_unit import Entry, Limits, Unit
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.experiments.experiment import SequenceSource
from trackmark.bench.experiments.tracker_spec import parse_trackers, run_identity

FRAMES = 12
LIMITS = Limits(frame_seconds=2, memory_bytes=1 << 30)


@pytest.fixture(scope="module")
def data_folder(tmp_path_factory, otb):
    """Create a folder with a sequence and the trackers; `faulthandler` escapes its name."""
    folder = tmp_path_factory.mktemp("grün")
    (folder / "hostile.py").write_text(hostile.source(folder / "hangs"))
    otb(folder / "A", FRAMES, first=0)
    return folder


@pytest.fixture
def clock_of_hangs(data_folder, monkeypatch):
    """Let the pool's clock go on only while a process hangs, however busy the machine is."""
    seconds = 0.0

    def monotonic():
        nonlocal seconds
        marker = data_folder / "hangs"
        try:
            os.kill(int(marker.read_text()), 0)
        except (FileNotFoundError, ValueError, ProcessLookupError):
            return seconds
        seconds += 0.2
        return seconds

    clock = SimpleNamespace(monotonic=monotonic)
    monkeypatch.setattr("trackmark.bench.engine.pool.time", clock)


@pytest.fixture(scope="module")
def lock_step(data_folder):
    """Return a unit of calm trackers and hostile ones in one process, by their names."""
    sequence = datasets.load(str(data_folder / "A"))

    def make(*names):
        texts = ["static", *(f"{data_folder}/hostile.py:{name}" for name in ("Calm", *names))]
        chosen = parse_trackers(texts)
        entries = tuple(
            Entry(text, 0, run_identity(chosen[text], sequence, 0).version) for text in texts
        )
        source = SequenceSource(str(data_folder / "A"))
        return Unit(source, entries, "accuracy", FRAMES, owner="hostile.py")

    return make


def run_units(units, limits=LIMITS):
    """Return the runs of each unit by class."""
    with closing(Pool(limits)) as pool:
        results = [result for _, result in pool.perform(units)]
    assert [str(result) for result in results if isinstance(result, Exception)] == []
    return [
        {run.identity.tracker.rpartition(":")[2]: run for run in runs.values()} for runs in results
    ]


@pytest.fixture(scope="module")
def undisturbed(data_folder):
    """Return the content of the calm trackers' runs without hostile trackers."""
    texts = {"static": "static", "Calm": f"{data_folder}/hostile.py:Calm"}
    return {
        name: content(bench.evaluate_run(text, str(data_folder / "A")))
        for name, text in texts.items()
    }


def content(run):
    details = {name: values.tobytes() for name, values in run.details.items()}
    return run.failure, run.boxes.tobytes(), details


def wrong(runs, names, undisturbed):
    """Return the runs that differ from what is expected, with the expected pattern or content."""
    assert runs.keys() == {*undisturbed, *names}
    differences = [
        name for name, expected in undisturbed.items() if content(runs[name]) != expected
    ]
    for name in names:
        pattern, run = hostile.CLASSES[name][0], runs[name]
        reason = run.failure.partition("\n")[0]
        as_expected = re.search(pattern, reason) if pattern else not reason
        if not as_expected:
            differences.append((name, pattern, reason))
        assert len(run.failure) < 100_000
        assert len(run.output) < 20_000
    return differences


def test_hostile_trackers_of_one_unit_cost_their_own_runs(
    lock_step, clock_of_hangs, undisturbed, capfd
):
    (runs,) = run_units([lock_step(*hostile.EVERYDAY)])
    assert runs["PrintsAndEnds"].output == "famous last \\udcff words\n"
    assert set(runs["Prints"].output.split()[1:]) == {"loud"}  # the first word may be cut
    assert np.isfinite(runs["Segfaults"].boxes[:, 0]).tolist() == [True] * 3 + [False] * 9
    assert wrong(runs, hostile.EVERYDAY, undisturbed) == []
    assert "loud" not in "".join(capfd.readouterr())


@pytest.mark.slow
def test_each_hostile_tracker_is_contained_in_lock_step(lock_step, clock_of_hangs, undisturbed):
    """Run each tracker twice in its own units: the second run meets the process of the first."""
    names = [name for name in hostile.CLASSES for _ in range(2)]
    units = [lock_step(name) for name in names]
    outcomes = zip(names, run_units(units), strict=True)
    differences = [wrong(runs, [name], undisturbed) for name, runs in outcomes]
    assert [item for items in differences for item in items] == []


def test_errors_and_malformed_estimates_cost_one_run(tmp_path, data_folder):
    """Run the hostile trackers in one pass over a sequence, next to calm trackers."""
    (tmp_path / "answers.py").write_text(hostile_answers.source())
    classes = runpy.run_path(str(tmp_path / "answers.py"))
    first, *others = parse_trackers([f"{data_folder}/hostile.py:Calm", "static"]).values()

    def hostile_tracker(name):
        kind = classes[name]
        return replace(
            first, label=name, name=name, make=lambda seed: kind(kind.Parameters(), seed)
        )

    rows = hostile_answers.ROWS
    sequence = datasets.load(str(data_folder / "A"))
    chosen = [first, *map(hostile_tracker, rows), *others]
    with warnings.catch_warnings(action="ignore"):
        runs = run_protocol([(entry, 0) for entry in chosen], sequence).runs
    for entry, run in zip(chosen, runs, strict=True):
        reason, _, _ = run.failure.partition("\n")
        if entry.name not in rows:
            (alone,) = run_protocol([(entry, 0)], sequence).runs
            assert reason == ""
            assert run.boxes.tobytes() == alone.boxes.tobytes()
        else:
            act, words = rows[entry.name]
            assert bool(reason) == bool(words), (act, reason)
            assert re.search(words, reason), (act, reason)
            assert len(run.failure) < 100_000, act
            if words:
                assert run.failure.startswith("0003.png: "), act
                assert np.isfinite(run.boxes[:3]).all(), act
                assert np.isnan(run.boxes[4:]).all(), act
