"""A flipped bit in any stored file, or another file in its place, is detected and named."""

import errno
import json
import os
import re
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pytest

from trackmark import bench
from trackmark.bench.store.asked import Asked
from trackmark.bench.store.checksum import PLACEHOLDER, SEAL_KEY, arrow_bytes, arrow_table, sealed
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.index import read_index
from trackmark.bench.store.layout import METADATA_KEY
from trackmark.bench.store.log import log_files, read_log
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import read_truth, write_truth
from trackmark.bench.store.upkeep import checks, damage, merge_results

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
        read = partial(read_truth, results.folder, key.sequence, key.fingerprint)
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


@pytest.mark.weekly
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


@pytest.mark.weekly
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


def test_files_that_are_exchanged_are_named_by_readers_and_by_the_check(several):
    """Each is whole by itself, but what it is (run, sequence, fingerprint) is inside its seal."""
    patterns = ("[!_]*/*/*.parquet", "*/*/*.revised.arrow", "*/*/*.npz", "_truth/*/*")
    kinds = [sorted(several.folder.glob(pattern)) for pattern in patterns]
    whole = {file: file.read_bytes() for kind in kinds for file in kind}
    assert len(set(whole.values())) == 4 * 3
    for kind in kinds:
        for place in kind:
            for other in {*kind, *(files[0] for files in kinds)} - {place}:
                place.write_bytes(whole[other])
                (said,) = filter(None, map(damage, checks(several.folder)))
                assert str(place) in said
                assert "\n" not in said
            with pytest.raises(ResultsError, match=re.escape(place.name)):
                bench.load_results(several.folder)  # which has no index
            place.write_bytes(whole[place])
    assert not any(map(damage, checks(several.folder)))
    assert len(bench.load_results(several.folder)) == 3


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("identity", "fingerprint"), 5),
        (("identity", "init"), []),
        (("identity", "preset"), None),
        (("identity", "repetition"), "0"),
        (("identity", "parameters"), "x"),
        (("companions",), None),
        (("companions", "arrays.npz"), "../../plan.json"),
        (("circumstances",), 5),
        (("circumstances", "seconds"), "x"),
        (("circumstances", "update_seconds"), "x"),
        (("circumstances", "source"), 5),
        (("failure",), ["why"]),
    ],
)
def test_what_a_run_says_of_itself_is_of_the_kind_that_is_expected(several, place, value):
    """A seal proves nothing but that the file is as somebody made it."""
    file = several.files()[0]
    table = parquet.ParquetFile(file).read()
    told = json.loads(table.schema.metadata[METADATA_KEY])
    within = told
    for key in place[:-1]:
        within = within[key]
    within[place[-1]] = value
    described = {METADATA_KEY: json.dumps(told).encode(), SEAL_KEY: PLACEHOLDER.encode()}
    sink = pa.BufferOutputStream()
    parquet.write_table(table.replace_schema_metadata(described), sink)
    file.write_bytes(sealed(sink.getvalue().to_pybytes()))
    for read in (
        lambda: bench.load_results(several.folder),
        lambda: merge_results([several.folder], several.folder.parent / "merged"),
    ):
        with pytest.raises(ResultsError, match=re.escape(file.name)) as error:
            read()
        assert "\n" not in str(error.value)


def told_anew(content, change):
    """A truth that says something else of itself, and is sealed again."""
    table = arrow_table(content)
    described = dict(table.schema.metadata)
    told = change(json.loads(described[METADATA_KEY]))
    return arrow_bytes(table, described | {METADATA_KEY: json.dumps(told).encode()})


@pytest.mark.parametrize(
    "wrong",
    [
        {"fingerprint": 5},
        {"fingerprint": None},
        {"name": []},
        {"regions": ["elsewhere"]},
        {"attributes": 5},
    ],
    ids=str,
)
def test_so_is_what_a_truth_says_of_itself(several, wrong):
    file = sorted(several.folder.glob("_truth/*/*"))[0]
    file.write_bytes(told_anew(file.read_bytes(), lambda told: told | wrong))
    (said,) = filter(None, map(damage, checks(several.folder)))
    assert f"{file} holds no truth" in said
    with pytest.raises(ResultsError, match=re.escape(file.name)):
        bench.load_results(several.folder)


def without_fingerprint(content):
    """A truth as it was stored before its fingerprint was kept in it."""
    return told_anew(content, lambda told: {key: told[key] for key in told if key != "fingerprint"})


def test_a_truth_of_before_is_read_and_known_by_its_sequence_alone(several, make_sequence):
    truths = sorted(several.folder.glob("_truth/*/*"))
    first = truths[0].read_bytes()
    for file in truths:
        file.write_bytes(without_fingerprint(file.read_bytes()))
    assert not any(map(damage, checks(several.folder)))
    line, _, other = (file.read_bytes() for file in truths)
    truths[0].write_bytes(other)
    assert "another truth, of other" in " ".join(map(damage, checks(several.folder)))
    truths[0].write_bytes(line)
    assert len(bench.load_results(several.folder)) == 3
    write_truth(several.folder, make_sequence(n=12, absent=(4,)))
    assert truths[0].read_bytes() == first, "from the next run on it says its fingerprint"


def test_no_text_in_a_file_leads_out_of_its_folder(make_sequence, tmp_path):
    """A fingerprint may say anything; what is copied by it stays in the target."""
    results = Results(tmp_path / "deep" / "inside" / "trial")
    sequence = make_sequence(n=12)
    sequence._fingerprint = "../../../outside"
    run = bench.evaluate("static", sequence)
    key = run.identity
    cell = (key.tracker, key.sequence, key.repetition, key.protocol)
    results.prepare(Asked("", {cell: key.version}))
    write_truth(results.folder, sequence)
    assert results.write(run)
    merge_results([results.folder], tmp_path / "deep" / "merged")
    top = {file.relative_to(tmp_path).parts[:2] for file in tmp_path.rglob("*.*")}
    assert top == {("deep", "inside"), ("deep", "merged")}
    assert len(bench.load_results(tmp_path / "deep" / "merged")) == 1
