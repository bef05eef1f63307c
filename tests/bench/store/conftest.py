"""What is done to a folder of results, step by step, for tests that disturb it."""

import hashlib
import os
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from trackmark import bench
from trackmark.bench.store.asked import Asked
from trackmark.bench.store.index import read_index
from trackmark.bench.store.log import RunLog, log_files, read_log
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import read_truth, write_truth


def with_companions(run, seed):
    """The run with revised boxes, arrays and a mask."""
    rng = np.random.default_rng(seed)
    n = len(run.boxes)
    arrays = {3: {"cloud": rng.random((5, 2)), "mask": np.eye(3, dtype=bool)}}
    return replace(run, boxes=rng.normal(size=(n, 4)), revised=rng.random((n, 4)), arrays=arrays)


def of_version(run, source):
    """The run, as another version of its tracker would have made it."""
    return replace(run, identity=replace(run.identity, tracker_version={"source": source}))


def digest(run):
    """Digest of all that a run says, without time and place."""
    said = [run.identity, run.failure, run.boxes.tobytes(), run.visible.tobytes()]
    said += [run.confidence.tobytes(), None if run.revised is None else run.revised.tobytes()]
    said += [(key, values.tobytes()) for key, values in run.details.items()]
    for frame, named in run.arrays.items():
        said += [(frame, key, values.tobytes()) for key, values in named.items()]
    return hashlib.sha256(repr(said).encode()).hexdigest()[:8]


class Scenario:
    """Something that is done to the results in `trial`, and begun again after a disturbance.

    Parameters
    ----------
    sequence : Sequence
        Of all its runs.
    present : list of Run
        What lies there before.
    wanted : list of Run
        What is run.
    removed : list of Run
        What is removed instead.
    logged : bool
        Whether a log is kept. It is not forced to the disk: there are many more crash states.
    """

    def __init__(self, sequence, present, wanted, removed=(), *, logged=False):
        self.sequence, self.present = sequence, present
        self.wanted, self.removed, self.logged = wanted, removed, logged

    def before(self, folder):
        """Lay down what is there before."""
        folder.mkdir()
        for step in self._run(folder / "trial", self.present) if self.present else ():
            step()

    def steps(self, folder):
        """Calls of the store, one after another, as a command makes them."""
        if self.removed:
            yield partial(self._remove, Results(folder / "trial"))
        yield from self._run(folder / "trial", self.wanted)

    def _run(self, folder, runs):
        results, log = Results(folder), RunLog(folder)
        keys = [run.identity for run in runs]
        cells = {(k.tracker, k.sequence, k.repetition, k.protocol): k.version for k in keys}
        yield partial(results.prepare, Asked("Trial", cells))
        if self.logged:
            yield partial(log.write, "start", runs=len(runs))
        for run in runs:
            yield partial(self._store, results, run)
        yield partial(read_index, results)
        if self.logged:
            yield partial(log.write, "end")

    def _store(self, results, run):
        path = results.path(run.identity)
        rows = {row["path"]: row for row in read_index(results)}
        row = rows.get(str(path.relative_to(results.folder)), {"version": ""})
        if row["version"] != run.identity.version:
            write_truth(results.folder, self.sequence)
            assert results.write(run, row["version"])

    def _remove(self, results):
        paths = {
            str(results.path(run.identity).relative_to(results.folder)) for run in self.removed
        }
        results.remove([row["path"] for row in read_index(results) if row["path"] in paths])


@pytest.fixture
def results(tmp_path):
    """Results of an experiment, of which nothing is there yet."""
    results = Results(tmp_path / "trial")
    results.prepare(Asked("Trial", {}))
    return results


@pytest.fixture
def sequence(make_sequence):
    """A short sequence whose target is absent once."""
    return make_sequence(n=12, absent=(4,))


@pytest.fixture
def store():
    """Evaluate a tracker and write the run with its truth; give it and its file."""

    def stored(results, sequence, tracker="static", repetition=0):
        run = bench.evaluate(tracker, sequence, repetition)
        write_truth(results.folder, sequence)
        assert results.write(run)
        return run, results.path(run.identity)

    return stored


@pytest.fixture
def scenarios(make_sequence):
    """What a store is disturbed in, by name."""
    sequence = make_sequence(n=12, absent=(4,))
    plain = bench.evaluate("static", sequence)
    other = bench.evaluate("camshift", sequence)
    old, new = (of_version(with_companions(plain, seed), f"v{seed}") for seed in (1, 2))
    bare = of_version(plain, "v3")
    return {
        "first runs": Scenario(sequence, [], [old, other]),
        "a stale run": Scenario(sequence, [old, other], [new], logged=True),
        "a stale run that had companions": Scenario(sequence, [old], [bare]),
        "a stale run that had none": Scenario(sequence, [bare], [new]),
        "removal": Scenario(sequence, [old, other], [], [old]),
    }


@pytest.fixture
def scratch(tmp_path):
    """A folder for thousands of files: in memory, where there is room for them."""
    memory = Path("/dev/shm")
    if not os.access(memory, os.W_OK):
        yield tmp_path
        return
    with TemporaryDirectory(dir=memory) as folder:
        yield Path(folder)


@pytest.fixture
def several(make_sequence, scratch):
    """Results with three files of every kind that are alike; two truths are of one name."""
    results = Results(scratch / "trial")
    made = []
    for number, (name, absent) in enumerate([("line", (4,)), ("line", (5,)), ("other", (4,))]):
        sequence = make_sequence(n=12, absent=absent, name=name)
        run = bench.evaluate("static", sequence, repetition=number)
        made.append((sequence, with_companions(run, number)))
    keys = [run.identity for _, run in made]
    results.prepare(
        Asked("", {(k.tracker, k.sequence, k.repetition, k.protocol): k.version for k in keys})
    )
    for sequence, run in made:
        write_truth(results.folder, sequence)
        assert results.write(run)
    return results


@pytest.fixture
def snapshot():
    """What a reader learns from the results in `trial`, by path; the plan is among it.

    Fails where a file is damaged, a run lacks what belongs to it, or the index is wrong.
    """

    def read(folder):
        results = Results(folder / "trial")
        files = results.files()
        runs = {str(file.relative_to(results.folder)): results.read(file) for file in files}
        rows = {row["path"]: row for row in read_index(results)}
        assert rows.keys() == runs.keys()
        for path, run in runs.items():
            assert rows[path]["version"] == run.identity.version
            read_truth(results.folder, run.identity.sequence, run.identity.fingerprint)
        for log in log_files(results.folder):
            list(read_log(log))
        asked = results.asked()
        return {path: digest(run) for path, run in runs.items()} | {
            "plan.json": (asked.title, dict(asked.cells))
        }

    return read


@pytest.fixture
def listing():
    """Names of all files in a folder but its logs, in order."""

    def read(folder):
        paths = sorted(path.relative_to(folder) for path in folder.rglob("*"))
        return [str(path) for path in paths if path.name != ".lock" and "_log" not in path.parts]

    return read


@pytest.fixture
def old_or_new():
    """Whether each file of a snapshot is as it was before, or as it is after."""

    def check(found, old, new):
        for path in old.keys() | new.keys() | found.keys():
            assert found.get(path) in (old.get(path), new.get(path)), path

    return check
