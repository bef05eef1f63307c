"""Random tests of runs, kills, tracker edits and removals in any order.

Requested runs must equal those of an undisturbed experiment. Tables must average only over
complete and current runs.
"""

import hashlib
import shutil
from collections import Counter
from contextlib import contextmanager
from itertools import count

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    rule,
    run_state_machine_as_test,
)

from trackmark.bench.analysis.run_tables import tables
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.execution.executor import Execution
from trackmark.bench.execution.worker import run_task
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.experiments.tracker_spec import parse_tracker, run_identity
from trackmark.bench.store.database import Database, run_key
from trackmark.bench.store.maintenance import find_damage
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.runs import Runs
from trackmark.datasets import load
from trackmark.reports.tables import MISSING

TRACKER = '''
"""Draws; in frame 2 of its editions that are odd it fails."""
import numpy as np
from trackmark.trackers.base.interface import Estimate, Randomness, TrackerPlugin

EDITION = {edition}


class {name}(TrackerPlugin):
    """A random walk."""

    randomness = Randomness.GENERATOR

    def init(self, image, box, mask=None):
        self.random = np.random.default_rng(self.seed)
        self.box = box.copy()
        self.frame = 0

    def update(self, image):
        self.frame += 1
        if EDITION % 2 and self.frame == 2:
            raise RuntimeError("odd")
        self.box[:2] += self.random.normal(size=2) + EDITION
        return Estimate(self.box.copy(), revised={{1: self.box.copy()}})
'''

EDITED = ("Walk", "Stroll")
TRACKERS = ("static", *EDITED)
SEQUENCES = ("A", "B")


class KilledError(BaseException):
    """Stand-in for the end of a process. The program must not catch it."""


@contextmanager
def killed(first_killed_call):
    """Raise `KilledError` from a database call on, counted from 0."""
    numbers = count()

    def deadly(call):
        def called(*arguments, **options):
            if next(numbers) >= first_killed_call:
                raise KilledError
            return call(*arguments, **options)

        return called

    with pytest.MonkeyPatch.context() as patch:
        for name in ("select", "rows", "insert", "delete"):
            patch.setattr(Database, name, deadly(getattr(Database, name)))
        yield


class InProcessExecutor:
    """Executor without processes."""

    n_workers = 1

    def run_tasks(self, tasks, limits, progress):
        for task in tasks:
            yield task, run_task(task, limits)


def content_digest(run):
    """Return a digest of a run without its times and metadata."""
    revised = None if run.revised is None else run.revised.tobytes()
    whole = (run.identity, run.failure.partition("\n")[0], run.boxes.tobytes(), revised)
    return hashlib.sha256(repr(whole).encode()).hexdigest()


class Experimenter(RuleBasedStateMachine):
    """State machine of a user with one results folder and its expected contents.

    Parameters
    ----------
    data_folder : Path
        Folder of the sequences.
    steps : Counter
        Counts of the actions and run states.
    """

    def __init__(self, data_folder, steps):
        super().__init__()
        self.data_folder, self.steps = data_folder, steps
        self.output = data_folder / "results"
        shutil.rmtree(self.output, ignore_errors=True)
        self.results = RunStore(self.output / "trial")
        self.runs, self.requested = {}, {}

    @initialize(editions=st.tuples(st.integers(0, 1), st.integers(0, 1)), whole=st.booleans())
    def begin(self, editions, whole):
        for name, edition in zip(EDITED, editions, strict=True):
            self._write(name, edition)
        if whole:
            self.run(set(TRACKERS), set(SEQUENCES), 2, False, None)

    # Actions

    @rule(
        trackers=st.sets(st.sampled_from(TRACKERS), min_size=1),
        sequences=st.sets(st.sampled_from(SEQUENCES), min_size=1),
        repetitions=st.integers(1, 2),
        retry_failed=st.booleans(),
        killed_at=st.none() | st.integers(0, 30),
    )
    def run(self, trackers, sequences, repetitions, retry_failed, killed_at):
        chosen = Experiment(
            "trial",
            tuple(self._text(name) for name in sorted(trackers)),
            tuple(SequenceSpec(str(self.data_folder / name)) for name in sorted(sequences)),
            repetitions=repetitions,
        )
        goal, requested = self._goal(chosen, retry_failed)
        execution = Execution(chosen, self.output, retry_failed=retry_failed)
        execution.cluster = InProcessExecutor()
        self._do(lambda: list(execution.rows()), killed_at, goal, requested)

    @rule(tracker=st.sampled_from(TRACKERS), killed_at=st.none() | st.integers(0, 8))
    def remove(self, tracker, killed_at):
        label = parse_tracker(self._text(tracker)).label
        cells = [cell for cell in self.results.list_keys() if cell[0] == label]
        goal = {cell: run for cell, run in self.runs.items() if cell not in cells}
        requested = {cell: version for cell, version in self.requested.items() if cell not in cells}
        if cells:
            self._do(lambda: self.results.remove(cells), killed_at, goal, requested)

    @rule(tracker=st.sampled_from(EDITED), edition=st.integers(0, 3))
    def edit(self, tracker, edition):
        self._write(tracker, edition)

    # Invariants

    @invariant()
    def stored_runs_are_the_expected_ones(self):
        assert self._stored_runs() == self.runs
        assert dict(Runs.unscored(self.results.folder).requested) == self.requested

    @invariant()
    def nothing_is_damaged(self):
        if self.results.folder.exists() and self.requested:
            assert find_damage(self.results.folder) == []

    @invariant()
    def each_run_has_the_expected_status(self):
        if not self.requested:
            return
        table = Runs.open(self.results.folder).table
        columns = ["tracker", "sequence", "repetition", "protocol"]
        rows = {tuple(row[column] for column in columns): row for _, row in table.iterrows()}
        stored_rows = table[table["status"] != "missing"].sort_values("date")
        newest = stored_rows.groupby("tracker")["tracker_version"].last()
        for cell, version in self.requested.items():
            if cell not in self.runs:
                expected = "missing"
            elif (
                self.runs[cell][0] != version
                or rows[cell]["tracker_version"] != newest[cell[0]]  # of an earlier edition
            ):
                expected = "stale"
            else:
                expected = self.runs[cell][1]
            assert rows[cell]["status"] == expected
            self.steps[expected] += 1

    def teardown(self):
        """Check the tables of the incomplete experiment, then run all of it undisturbed."""
        self._check_that_only_complete_runs_are_averaged()
        self.run(set(TRACKERS), set(SEQUENCES), 2, True, None)
        self.stored_runs_are_the_expected_ones()
        assert {run[0] for run in self.runs.values()} == {
            self._oracle(tracker, sequence, 0)[0] for tracker in TRACKERS for sequence in SEQUENCES
        }

    # Helpers

    def _text(self, name):
        return name if name == "static" else f"{self.data_folder}/{name.lower()}.py:{name}"

    def _write(self, name, edition):
        source = TRACKER.format(name=name, edition=edition)
        (self.data_folder / f"{name.lower()}.py").write_text(source)

    def _oracle(self, tracker, sequence, repetition):
        """Return version, status and digest of an undisturbed run."""
        run = evaluate_run(self._text(tracker), str(self.data_folder / sequence), repetition)
        return run.identity.version, run.status, content_digest(run)

    def _goal(self, chosen, retry_failed):
        """Return the expected runs and requested versions after an experiment."""
        goal, requested = dict(self.runs), dict(self.requested)
        for source in chosen.sequences:
            sequence = load(source.spec)
            for text in chosen.trackers:
                entry = parse_tracker(text)
                for repetition in range(chosen.repetitions if entry.name != "static" else 1):
                    key = run_identity(entry, sequence, repetition)
                    requested[key.tracker, key.sequence, repetition, "one-pass"] = key.version
                    version, status, _ = self.runs.get(run_key(key), ("", "", ""))
                    if version != key.version or (retry_failed and status == "failed"):
                        run = evaluate_run(text, sequence, repetition)
                        goal[run_key(key)] = run.identity.version, run.status, content_digest(run)
                for cell in requested:  # one version counts for all repetitions
                    if cell[:2] == (key.tracker, key.sequence):
                        requested[cell] = key.version
        return goal, requested

    def _do(self, action, killed_at, goal, requested):
        """Perform an action that may be killed. Runs and manifest are then either old or new."""
        self.steps["actions"] += 1
        if killed_at is not None:
            try:
                with killed(killed_at):
                    action()
            except KilledError:
                self.steps["kills"] += 1
                stored_runs = self._stored_runs()
                for cell in stored_runs.keys() | goal.keys() | self.runs.keys():
                    assert stored_runs.get(cell) in (self.runs.get(cell), goal.get(cell))
                noted = dict(Runs.unscored(self.results.folder).requested)
                assert noted in (self.requested, requested)
                self.runs, self.requested = stored_runs, noted
                return
        else:
            action()
        self.runs, self.requested = goal, requested

    def _check_that_only_complete_runs_are_averaged(self):
        if not self.requested:
            return
        bench_tables = tables(Runs.open(self.results.folder))
        incomplete = {
            cell[0]
            for cell, version in self.requested.items()
            if self.runs.get(cell, ("", ""))[:2] != (version, "finished")
        }
        for table in bench_tables:
            if table.name == "summary":
                for label, *cells in table.rows:
                    blank = all(cell.text.startswith(MISSING) for cell in cells)
                    assert blank or label.text not in incomplete

    def _stored_runs(self):
        """Return version, status and digest of the stored runs."""
        runs = {cell: self.results.read(cell) for cell in self.results.list_keys()}
        return {
            cell: (run.identity.version, run.status, content_digest(run))
            for cell, run in runs.items()
        }


@pytest.fixture
def experiment(tmp_path, monkeypatch, evidence, otb, in_this_process):
    """Return a function that runs the state machine and counts its actions."""
    monkeypatch.setenv("TRACKMARK_CACHE", str(tmp_path / "cache"))
    for name in SEQUENCES:
        otb(tmp_path / name, 5)

    def done(examples, steps, **options):
        counted = Counter()
        run_state_machine_as_test(
            lambda: Experimenter(tmp_path, counted),
            settings=settings(
                max_examples=examples,
                stateful_step_count=steps,
                deadline=None,
                phases=[Phase.generate],  # shrinking an example takes longer than reading it
                suppress_health_check=list(HealthCheck),
                **options,
            ),
        )
        evidence(f"state machine: {dict(counted)}")
        return counted

    return done


@pytest.mark.slow
def test_any_order_of_actions_gives_undisturbed_results(experiment):
    counted = experiment(examples=3, steps=12, derandomize=True)
    assert counted["kills"] > 3
    assert min(counted[status] for status in ("missing", "stale", "failed", "finished")) > 0


@pytest.mark.weekly
def test_many_orders_of_actions_give_undisturbed_results(experiment):
    assert experiment(examples=80, steps=20)["kills"] > 100
