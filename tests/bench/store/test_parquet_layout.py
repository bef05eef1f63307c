"""Results of an older trackmark, Parquet files in `parquet_results.zip`, are converted."""

import builtins
import re
import zipfile
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from tests.bench.store.conftest import full_run
from tests.bench.store.test_results import assert_same
from trackmark import bench
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.maintenance import find_damage
from trackmark.bench.store.parquet_layout import convert_results
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import read_truth
from trackmark.datasets.shapes import EncodedMask, Shapes

N = 12


@pytest.fixture
def old(tmp_path):
    """Return a folder with results in the old format."""
    with zipfile.ZipFile(Path(__file__).parent / "parquet_results.zip") as archive:
        archive.extractall(tmp_path / "old")
    return tmp_path / "old"


@pytest.fixture
def written(make_sequence):
    """Return the sequence of the old results."""
    shapes = {
        0: np.array([[1.5, 2], [9.1, 2], [9, 8], [0.1, 7]]),
        1: EncodedMask(3, 4, 5, 2, np.array([2, 5, 3])),
    }
    return make_sequence(
        n=N,
        absent=(4,),
        name="a/b:c=1",
        regions={"full": np.ones((N, 4))},
        visibility=np.linspace(0, 1, N),
        attributes={"occlusion": np.arange(N) > 3},
        fps=12.5,
        shapes=Shapes(shapes, range(N), (32, 24)),
    )


def test_converted_results_are_equal_to_the_bit(old, written, trackmark):
    pytest.importorskip("pyarrow")
    assert "converted 2 runs" in trackmark("results", "convert", old).stdout
    results = Results(old)
    assert find_damage(old) == []
    runs = [results.read(cell) for cell in results.list_keys()]
    expected = [bench.evaluate_run("static", written), full_run(written)]
    for run, other in zip(runs, expected, strict=True):
        for field in fields(run):
            if field.name not in ("circumstances", "output", "identity"):
                assert_same(getattr(run, field.name), getattr(other, field.name))
        assert (run.identity.sequence, run.identity.fingerprint) == (
            written.name,
            written.fingerprint,
        )
    assert runs[1].output == "several\nlines"
    manifest = results.manifest()
    assert (manifest.title, len(manifest.versions)) == ("Older", 3)
    frame = bench.load_runs(old)
    assert frame["status"].tolist() == ["failed", "finished", "missing"]
    truth = read_truth(old, written.name, written.fingerprint)
    for name in ("boxes", "visibility", "regions", "attributes", "fps"):
        np.testing.assert_equal(getattr(truth, name), getattr(written, name))
    for ours, theirs in zip(truth.shapes, written.shapes, strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_damaged_files_are_named_and_nothing_is_converted(old):
    pytest.importorskip("pyarrow")
    files = [f for f in old.rglob("*") if f.suffix in (".parquet", ".arrow", ".npz", ".json")]
    assert len(files) == 6
    for file in files:
        whole = file.read_bytes()
        file.write_bytes(whole[:99] + bytes([whole[99] ^ 1]) + whole[100:])
        with pytest.raises(ResultsError, match=re.escape(f"{file} is damaged")):
            convert_results(old)
        file.write_bytes(whole)
    assert {
        path.name for path in old.iterdir() if "runs" in path.name or path.name[0] == "."
    } == set()
    convert_results(old)
    with pytest.raises(ResultsError, match=r"runs\.db already exists"):
        convert_results(old)


def test_without_pyarrow_the_extra_is_named(old, monkeypatch):
    plain = builtins.__import__

    def refuse(name, *others):
        if name.startswith("pyarrow"):
            raise ImportError(name)
        return plain(name, *others)

    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(ResultsError, match=re.escape("pip install 'trackmark[parquet]'")):
        convert_results(old)
