"""Stored scores are computed again after a change of the code that defines them."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import trackmark
from trackmark.bench.store.run_rows import scorer_digest
from trackmark.bench.store.runs import Runs

PACKAGE = Path(trackmark.__file__).parent
PRINT_OVERLAP = """
import sys
from pathlib import Path
from trackmark.bench.store.runs import Runs
print(Runs.open(Path(sys.argv[1])).table["mean_overlap"][0])
"""


@pytest.fixture
def copy(tmp_path):
    """Copy the package without the files that scores cannot depend on."""
    shutil.copytree(
        PACKAGE,
        tmp_path / "copy" / "trackmark",
        ignore=shutil.ignore_patterns("__pycache__", "papers", "synthetic", "*.mp4"),
    )
    return tmp_path / "copy" / "trackmark"


def replace_once(file, old, new):
    text = file.read_text()
    assert text.count(old) == 1, (file, old)
    file.write_text(text.replace(old, new))


def test_scores_are_computed_again_after_edit_of_preset(copy, several):
    def overlap():
        done = subprocess.run(
            [sys.executable, "-c", PRINT_OVERLAP, several.folder],
            env=os.environ | {"PYTHONPATH": str(copy.parent)},
            cwd=copy.parent,
            capture_output=True,
            text=True,
            check=True,
        )
        return float(done.stdout)

    expected = Runs.open(several.folder).table["mean_overlap"][0]
    assert overlap() == expected
    native = copy / "bench/metrics/sets/native.py"
    replace_once(native, '"mean_overlap": _mean(overlaps)', '"mean_overlap": _mean(overlaps) / 2')
    assert overlap() == expected / 2


@pytest.mark.parametrize(
    ("file", "is_used"),
    [
        ("metrics/sets/native.py", True),
        ("metrics/boxes.py", True),
        ("evaluation/ground_truth.py", True),
        ("protocols/one_pass.py", True),
        ("store/truth.py", True),
        ("analysis/comparison.py", False),
    ],
)
def test_scorer_digest_covers_all_modules_that_score(copy, file, is_used):
    before = scorer_digest(copy / "bench")
    source = copy / "bench" / file
    source.write_text(source.read_text() + "\nCHANGED = True\n")
    assert (scorer_digest(copy / "bench") != before) == is_used
