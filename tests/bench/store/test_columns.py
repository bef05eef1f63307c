"""Tables of numbers, made without pandas."""

import subprocess
import sys

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import feather

from trackmark.bench.store.checksum import PLACEHOLDER, SEAL_KEY, arrow_bytes, sealed
from trackmark.bench.store.columns import as_columns


@pytest.mark.parametrize("n", [0, 1, 9, 70_000])
def test_tables_and_files_are_those_that_pyarrow_makes(n):
    numbers = np.where(np.arange(n) % 4 == 0, np.nan, np.arange(n) - 2.5)
    arrays = {
        "x": numbers,
        "every other": np.repeat(numbers, 2)[::2],
        "flag": np.arange(n) % 3 == 0,
        "frame": np.arange(n, dtype=np.int32),
    }
    told = pa.table({name: np.ascontiguousarray(values) for name, values in arrays.items()})
    made = as_columns(arrays)
    assert made.schema == told.schema
    assert all(np.array_equal(made[c], told[c], equal_nan=c != "flag") for c in arrays)
    sink = pa.BufferOutputStream()
    named = told.replace_schema_metadata({SEAL_KEY: PLACEHOLDER.encode()})
    feather.write_feather(named, sink, compression="zstd")
    assert arrow_bytes(made) == sealed(sink.getvalue().to_pybytes())


def test_what_stores_runs_does_without_pandas():
    code = """
import sys
import numpy as np
from trackmark.bench.engine import worker
from trackmark.bench.store.columns import as_columns
from trackmark.bench.store.checksum import arrow_bytes
arrow_bytes(as_columns({"x": np.arange(9.0), "flag": np.arange(9) > 4}))
sys.exit("pandas" in sys.modules)
"""
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
