"""Kills, full disks, flipped bits and other processes lose or change no acknowledged run."""

import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from tests.bench.stored_truths import add_truth_of
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.store import database as module
from trackmark.bench.store import runs as runs_module
from trackmark.bench.store.database import ResultsError
from trackmark.bench.store.maintenance import find_damage, merge_results
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.runs import Runs
from trackmark.bench.store.truth import read_truth

WRITER = """
import sys
from pathlib import Path
from tests.bench.store.test_durability import make_run
from trackmark.bench.store.run_store import RunStore
results, first = RunStore(Path(sys.argv[1])), int(sys.argv[2])
for number in range(first, first + 100_000):
    assert results.add(make_run(number))
    print(number, flush=True)
"""


def make_run(number):
    """Return a run without tracker and sequence."""
    rng = np.random.default_rng(number)
    identity = Identity("t", "t", "", {}, {"source": "1"}, "s", "f", number, "one-pass")
    boxes = rng.random((50, 4))
    return Run(identity, boxes=boxes, visible=boxes[:, 0] > 0.5, confidence=boxes[:, 1])


def assert_whole(results, numbers):
    """Check that the runs of these numbers are stored, and at most one more per writer."""
    assert damages_without_truth(results.folder) == []
    stored = {cell[2] for cell in results.list_keys()}
    assert set(numbers) <= stored
    for number in stored:
        run = results.read(("t", "s", number, "one-pass"))
        np.testing.assert_array_equal(run.boxes, make_run(number).boxes)
    return len(stored)


def damages_without_truth(folder):
    """Return the damage of the file itself: the runs of these tests have no ground truth."""
    with module.open_database(folder) as database:
        return database.find_damage()


def killed_round(folder, first, delay):
    """Start a writer, kill it, and return the numbers of the runs that it reported as stored."""
    command = [sys.executable, "-c", WRITER, str(folder), str(first)]
    root = Path(__file__).parents[3]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=root) as writer:
        reported = [int(writer.stdout.readline())]
        time.sleep(delay)
        writer.send_signal(signal.SIGKILL)
        rest = writer.stdout.read()
    return reported + [int(line) for line in rest.splitlines(keepends=True) if line.endswith("\n")]


@pytest.mark.parametrize("rounds", [3, pytest.param(100, marks=pytest.mark.slow)])
def test_killed_writer_loses_no_acknowledged_run(tmp_path, rounds, evidence):
    results = RunStore(tmp_path / "trial")
    delays = np.random.default_rng(0).random(rounds) * 0.3
    reported = []
    for number, delay in enumerate(delays):
        reported += killed_round(results.folder, number * 100_000, delay)
    stored = assert_whole(results, reported)
    assert stored - len(reported) <= rounds
    evidence(f"{rounds} kills: {len(reported)} acknowledged runs, {stored} stored, none lost")


def test_interrupted_transaction_is_undone_by_next_reader(several):
    """Copy file and journal during a transaction: a killed writer leaves the same files."""
    file, journal = several.folder / "runs.db", several.folder / "runs.db-journal"
    before = contents(several)
    writer = sqlite3.connect(file, isolation_level=None)
    writer.execute("PRAGMA cache_size = 1")
    writer.execute("BEGIN IMMEDIATE")
    writer.execute("UPDATE run SET arrays = randomblob(20000)")
    writer.execute("UPDATE truth SET fingerprint = 'x'")
    left = several.folder.parent / "left" / "trial"
    left.mkdir(parents=True)
    for path in (file, journal):
        shutil.copy(path, left / path.name)
    writer.execute("ROLLBACK")
    writer.close()
    assert (left / "runs.db").read_bytes() != file.read_bytes()
    assert contents(RunStore(left)) == before
    assert not (left / journal.name).exists()


@pytest.fixture(autouse=True)
def _repeated_warnings():
    """Print warnings also if an earlier test has printed them."""
    module.warn_of_damage.cache_clear()


def contents(results):
    """Return everything that is stored, as text."""
    folder = results.folder
    runs = Runs.open(results.folder)
    stored = [runs.title, list(runs.requested.items()), runs.stored_rows]
    for cell in results.list_keys():
        run = results.read(cell)
        arrays = [run.boxes, run.visible, run.confidence, *run.details.values()]
        arrays += [array for named in run.arrays.values() for array in named.values()]
        arrays += [] if run.revised is None else [run.revised]
        truth = read_truth(folder, run.identity.sequence, run.identity.fingerprint)
        arrays += [truth.boxes, truth.visibility]
        stored += [cell, run.identity, run.failure, run.tracker_output, run.metadata]
        stored += [[array.tobytes() for array in arrays], truth.fps, truth.image_size]
    return repr(stored)


def damage(results, change, places, caplog):
    """Damage the file at places one by one; return the numbers of reports and of no effects.

    `change` returns the changed content of the file.
    """
    file = results.folder / "runs.db"
    whole, expected = file.read_bytes(), contents(results)
    assert find_damage(results.folder) == []
    counts = {"reported": 0, "no effect": 0}
    for place in places:
        file.write_bytes(change(whole, place))
        messages = find_damage(results.folder)
        assert all(str(file) in message and "\n" not in message for message in messages)
        module.warn_of_damage.cache_clear()
        caplog.clear()
        try:
            same = contents(results) == expected
        except ResultsError:
            assert messages, "a reader reports damage that the check does not"
            counts["reported"] += 1
        else:  # a reader may leave out a damaged run, with a warning or as missing
            missing = "missing" in Runs.open(results.folder).table["status"].tolist()
            assert same or caplog.messages or missing, f"the damage at {place} is not reported"
            counts["reported" if messages else "no effect"] += 1
    file.write_bytes(whole)
    assert contents(results) == expected
    return counts


def flip_bit(content, bit):
    changed = bytearray(content)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


@pytest.mark.parametrize("number", [60, pytest.param(3000, marks=pytest.mark.slow)])
def test_no_flipped_bit_is_silent(several, number, evidence, caplog):
    size = 8 * (several.folder / "runs.db").stat().st_size
    bits = np.random.default_rng(0).choice(size, number, replace=False).tolist()
    counts = damage(several, flip_bit, bits, caplog)
    evidence(f"{number} flipped bits: {counts}, none silent")


@pytest.mark.parametrize(
    ("change", "table"),
    [
        ("UPDATE run SET status = 'finished', failure = '' WHERE id = 4", "run"),
        ("UPDATE run SET seconds = 2 WHERE id = 4", "run"),
        ("UPDATE run SET failure = CAST(x'ff' AS TEXT) WHERE id = 4", "run"),
        ("UPDATE run SET identity = '{}' WHERE id = 4", "run"),
        ("UPDATE run SET arrays = zeroblob(9) WHERE id = 4", "run"),
        ("UPDATE run SET sha256 = zeroblob(32) WHERE id = 4", "run"),
        ("DELETE FROM run WHERE id = 4", None),
    ],
)
def test_changed_or_deleted_run_is_missing_and_named(several, change, table, caplog):
    last = several.read(several.list_keys()[-1])
    edit(several, change)
    frame = Runs.open(several.folder).table
    assert frame["status"].tolist() == ["finished"] * 3 + ["missing"]
    messages = find_damage(several.folder)
    if table:
        (message,) = messages
        assert "a row of its table 'run' was changed (4, static, line, 2, timing)" in message
        assert message in caplog.text
        with pytest.raises(ResultsError, match=r"was changed \(4, static, line"):
            several.read(several.list_keys()[-1])
    else:
        assert messages == []
    assert several.add(last)
    assert find_damage(several.folder) == []
    assert Runs.open(several.folder).table["status"].tolist() == ["finished"] * 3 + ["failed"]


def test_damaged_ground_truth_costs_only_its_runs(several, store, make_sequence, caplog):
    other = make_sequence(n=12, name="other")
    run = store(several, other)
    edit(several, "UPDATE truth SET arrays = zeroblob(9) WHERE sequence = 'other'")
    for _ in range(2):
        assert [row["sequence"] for row in Runs.open(several.folder).stored_rows] == ["line"] * 4
    assert "runs.db is damaged: a row of its table 'truth' was changed (other" in caplog.text
    add_truth_of(several.folder, other)  # a repeated run restores the damaged row
    assert not several.add(run)
    assert find_damage(several.folder) == []
    assert len(Runs.open(several.folder).stored_rows) == 5


def test_damaged_requests_are_named_and_restored_by_repetition(several, caplog):
    requested = Runs.unscored(several.folder).requested
    edit(several, "UPDATE metadata_of_file SET value = replace(value, 'Trial', 'Other')")
    assert len(Runs.open(several.folder).table) == 4
    (message,) = find_damage(several.folder)
    assert message in caplog.text
    several.add_requests(requested, "Trial")
    assert find_damage(several.folder) == []
    assert Runs.unscored(several.folder).requested == requested


@pytest.mark.parametrize("change", ["scores = '{}'", "sha256 = zeroblob(32)"])
def test_damaged_scores_are_computed_again(several, change):
    expected = contents(several)
    edit(several, f"UPDATE score SET {change} WHERE run = 1")
    assert find_damage(several.folder)
    assert contents(several) == expected
    assert find_damage(several.folder) == []


def edit(results, change):
    database = sqlite3.connect(results.folder / "runs.db")
    database.execute(change)
    database.commit()
    database.close()


def test_damaged_runs_can_be_removed(several):
    edit(several, "UPDATE run SET failure = 'x'")
    edit(several, "UPDATE truth SET arrays = zeroblob(9)")
    assert find_damage(several.folder)
    several.remove(several.list_keys())
    assert find_damage(several.folder) == []
    assert several.list_keys() == []


def test_truncated_file_is_reported(several, caplog):
    size = (several.folder / "runs.db").stat().st_size
    lengths = range(1, size, size // 40)
    counts = damage(several, lambda content, length: content[:length], lengths, caplog)
    assert counts["no effect"] <= 1  # unused bytes at the end


def write_error(results, number):
    try:
        results.add(make_run(number))
    except ResultsError as error:
        return str(error)
    return ""


def test_full_disk_keeps_runs_readable_and_file_writable(tmp_path, monkeypatch):
    results = RunStore(tmp_path / "trial")
    limited = module._open

    def limit(path, *, for_writing):
        connection = limited(path, for_writing=for_writing)
        connection.execute("PRAGMA max_page_count = 60")
        return connection

    results.add_requests({})
    with monkeypatch.context() as patch:
        patch.setattr(module, "_open", limit)
        stored = 0
        while not (refused := write_error(results, stored)):
            stored += 1
    assert "runs.db cannot be read or written: database or disk is full. Free disk space" in refused
    assert stored > 5
    assert assert_whole(results, range(stored)) == stored
    results.add(make_run(stored))
    assert assert_whole(results, range(stored + 1)) == stored + 1


def write_some(folder, first):
    results = RunStore(folder)
    for number in range(first, first + 8):
        results.add_requests({("t", "s", number, "one-pass"): make_run(number).identity.version})
        assert results.add(make_run(number))
    return first


def test_two_commands_in_one_folder_lose_nothing(tmp_path):
    folder = tmp_path / "trial"
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as executor:
        work = [executor.submit(write_some, folder, first) for first in (0, 100)]
        while not all(future.done() for future in work):
            if folder.exists():
                RunStore(folder).list_keys()  # reads while the others write
        assert [future.result() for future in work] == [0, 100]
    numbers = [*range(8), *range(100, 108)]
    assert assert_whole(RunStore(folder), numbers) == 16
    assert {cell[2] for cell in Runs.unscored(folder).requested} == set(numbers)


def test_permanent_lock_is_reported(several, monkeypatch):
    monkeypatch.setattr(module, "_BUSY_SECONDS", 0.05)
    other = sqlite3.connect(several.folder / "runs.db", isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    assert len(several.list_keys()) == 4, "readers go on"
    with pytest.raises(ResultsError, match=r"runs\.db: another process has locked this file"):
        several.add(make_run(0))
    other.close()


def test_read_only_folder_is_read(several, monkeypatch):
    """`query_only` refuses writes as a read-only file system does; root ignores permissions."""
    plain = module._open

    def read_only(path, *, for_writing):
        connection = plain(path, for_writing=for_writing)
        connection.execute("PRAGMA query_only = ON")
        return connection

    edit(several, "DELETE FROM score")
    database = several.folder / "runs.db"
    before = database.read_bytes()
    monkeypatch.setattr(module, "_open", read_only)
    assert len(Runs.open(several.folder).table) == 4
    with pytest.raises(ResultsError, match=r"runs\.db cannot be read or written.*permissions"):
        several.add(make_run(0))
    assert database.read_bytes() == before


@pytest.mark.parametrize(
    ("name", "is_damage", "remedy"),
    [
        ("SQLITE_CORRUPT_INDEX", True, "Restore the file from a backup"),
        ("SQLITE_NOTADB", True, "Restore the file from a backup"),
        ("SQLITE_PROTOCOL", False, "local disk"),
        ("SQLITE_NOMEM", False, "Free some memory"),
        ("SQLITE_IOERR_NOMEM", False, "Free some memory"),
        ("SQLITE_IOERR_READ", False, "check the disk"),
        ("SQLITE_FULL", False, "Free disk space"),
        ("SQLITE_INTERRUPT", False, "Run the same command again"),
        ("SQLITE_PERM", False, "permissions"),
        ("SQLITE_ERROR", False, "Run the same command again"),
    ],
)
def test_only_corrupt_files_are_called_damaged(several, monkeypatch, name, is_damage, remedy):
    def fail(*_, **__):
        error = sqlite3.OperationalError("reason")
        error.sqlite_errorname = name
        raise error

    monkeypatch.setattr(module, "_validate", fail)
    with pytest.raises(ResultsError, match=remedy) as caught:
        several.list_keys()
    assert isinstance(caught.value, module.DamagedError) == is_damage
    assert ("is damaged" in str(caught.value)) == is_damage
    assert ("remove it" in str(caught.value)) == is_damage


def test_file_of_zero_bytes_is_damaged(several):
    (several.folder / "runs.db").write_bytes(b"")
    assert "it has 0 bytes" in find_damage(several.folder)[0]
    with pytest.raises(ResultsError, match="it has 0 bytes"):
        Runs.open(several.folder)


def drop_last_entry_of_index(folder):
    """Remove an entry of the index of the runs' keys, without a trace in the table."""
    file = folder / "runs.db"
    with closing(sqlite3.connect(file)) as database:
        query = "SELECT rootpage FROM sqlite_schema WHERE name = 'sqlite_autoindex_run_1'"
        ((root,),) = database.execute(query)
        ((size,),) = database.execute("PRAGMA page_size")
    content, place = bytearray(file.read_bytes()), (root - 1) * size + 3
    entries = int.from_bytes(content[place : place + 2], "big")
    content[place : place + 2] = (entries - 1).to_bytes(2, "big")
    file.write_bytes(content)


def test_merge_recovers_the_runs_of_a_damaged_index(several, tmp_path):
    before, keys = contents(several), several.list_keys()
    drop_last_entry_of_index(several.folder)
    assert find_damage(several.folder)
    recovered = RunStore(tmp_path / "recovered")
    assert merge_results([several.folder], recovered.folder) == (len(keys), [])
    assert find_damage(recovered.folder) == []
    assert contents(recovered) == before


def test_runs_are_unpacked_from_one_transaction(several, monkeypatch):
    """Runs that exceed the memory limit are read again; they are equal."""
    boxes = {}
    for limit in (runs_module.MAX_KEPT, 0):
        monkeypatch.setattr(runs_module, "MAX_KEPT", limit)
        stored = Runs.unscored(several.folder)
        assert len(stored._runs) == (4 if limit else 0)
        boxes[limit] = [stored.run(key).boxes.tobytes() for key in several.list_keys()]
    assert len({*map(tuple, boxes.values())}) == 1
