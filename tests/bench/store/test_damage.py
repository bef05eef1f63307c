"""A flipped bit in any stored file is detected, and the file named."""

import errno
import os
import re
from pathlib import Path

import numpy as np
import pytest

import bench
from bench.store.files import ResultsError
from bench.store.index import read_index
from bench.store.log import log_files, read_log
from bench.store.results import Results
from bench.store.truth import read_truth

KINDS = ["run", "revised", "arrays", "truth", "plan"]


@pytest.fixture
def stored(scenarios, scratch):
    """Results with every kind of file."""
    scenarios["a stale run"].before(scratch / "folder")
    return Results(scratch / "folder" / "trial")


def file_and_reader(results, kind):
    """A file of a kind, and what reads it."""
    run = next(results.folder.glob("static/*/*.parquet"))
    key = results.read(run).identity
    patterns = {"revised": "*.revised.arrow", "arrays": "*.npz", "run": "*.parquet"}
    if kind in patterns:
        return next(run.parent.glob(patterns[kind])), lambda: results.read(run)
    if kind == "truth":
        read = lambda: read_truth(results.folder, key.sequence, key.fingerprint)  # noqa: E731
        return next(results.folder.glob("_truth/*/*.arrow")), read
    if kind == "log":
        (file,) = log_files(results.folder)
        return file, lambda: list(read_log(file))
    return results.folder / "plan.json", results.asked


def size_in_bits(file, kind):
    """Of what is checked: without its last end of line a log's last line counts as torn."""
    return 8 * (file.stat().st_size - (kind == "log"))


def flipped(content, bit):
    changed = bytearray(content)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def assert_every_flip_is_named(file, read, bits):
    whole = file.read_bytes()
    for bit in bits:
        file.write_bytes(flipped(whole, bit))
        with pytest.raises(ResultsError) as error:
            read()
        assert str(file) in str(error.value)
        assert "\n" not in str(error.value)
    file.write_bytes(whole)
    read()


@pytest.mark.parametrize("kind", [*KINDS, "log"])
def test_a_flipped_bit_is_detected_and_the_file_named(stored, evidence, kind):
    file, read = file_and_reader(stored, kind)
    size = size_in_bits(file, kind)
    bits = np.random.default_rng(0).choice(size, min(500, size), replace=False).tolist()
    assert_every_flip_is_named(file, read, bits)
    evidence(f"{kind}: {len(bits)} of {len(bits)} flipped bits were detected")


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*KINDS, "log"])
def test_each_single_bit_of_a_file_counts(stored, evidence, kind):
    file, read = file_and_reader(stored, kind)
    size = size_in_bits(file, kind)
    assert_every_flip_is_named(file, read, range(size))
    evidence(f"{kind}: {size} of {size} bits, flipped one by one, were detected")


def rows_survive(results, bits):
    """An index with a flipped bit is made anew, equal to what it was."""
    index = results.folder / "index.arrow"
    rows, whole = read_index(results), index.read_bytes()
    assert rows
    for bit in bits:
        index.write_bytes(flipped(whole, bit))
        assert read_index(results) == rows
        assert index.read_bytes() == whole


def test_an_index_with_a_flipped_bit_is_made_anew(stored):
    size = 8 * (stored.folder / "index.arrow").stat().st_size
    rows_survive(stored, np.random.default_rng(0).choice(size, 60, replace=False).tolist())


@pytest.mark.slow
def test_an_index_with_any_byte_changed_is_made_anew(stored):
    size = (stored.folder / "index.arrow").stat().st_size
    rows_survive(stored, [8 * byte + byte % 8 for byte in range(size)])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("code", ["EIO", "EACCES"])
def test_a_file_that_can_not_be_read_is_named_and_not_called_damaged(
    stored, monkeypatch, kind, code
):
    file, read = file_and_reader(stored, kind)
    plain = Path.read_bytes

    def fail(path):
        if path == file:
            raise OSError(getattr(errno, code), os.strerror(getattr(errno, code)), str(path))
        return plain(path)

    monkeypatch.setattr(Path, "read_bytes", fail)
    with pytest.raises(ResultsError) as error:
        read()
    assert str(file) in str(error.value)
    assert os.strerror(getattr(errno, code)) in str(error.value)
    assert "emove" not in str(error.value), "what can't be read now may be whole"


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_cut_anywhere_is_named(stored, kind):
    file, read = file_and_reader(stored, kind)
    whole = file.read_bytes()
    for length in range(0, len(whole), max(1, len(whole) // 100)):
        file.write_bytes(whole[:length])
        with pytest.raises(ResultsError, match=re.escape(file.name)):
            read()


def test_runs_that_are_swapped_are_noticed(stored):
    """Each is whole by itself, but says that it belongs elsewhere."""
    a, b = stored.files()
    one, other = a.read_bytes(), b.read_bytes()
    a.write_bytes(other)
    b.write_bytes(one)
    with pytest.raises(ResultsError, match=r"0\.parquet"):
        bench.load_results(stored.folder)
