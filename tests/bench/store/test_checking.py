"""`results check` names what is damaged or missing; frames of an unfinished run are kept."""

import json
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from trackmark import bench
from trackmark.bench.store.layout import UNFINISHED
from trackmark.bench.store.results import Results
from trackmark.bench.store.upkeep import checks, damage

MINE = ("--sequences", "data/Small", "--name", "mine")
RUN = ("run", "--trackers", "static,camshift", *MINE)
SLOW = "__import__('time').sleep(0.05)\n        return Estimate"


@pytest.fixture
def stored(trackmark, here):
    trackmark(*RUN)
    return here / "results" / "mine"


def damages(folder):
    return [said for said in map(damage, checks(folder)) if said]


def test_nothing_is_said_of_what_is_whole(stored, trackmark):
    assert len(checks(stored)) == 6, "plan, two runs, truth, log, index"
    assert damages(stored) == []
    assert "6 files, none damaged" in trackmark("results", "check", "results").stdout


def test_every_file_that_is_damaged_is_named(stored):
    files = [file for file in stored.rglob("*") if file.is_file() and file.name != ".lock"]
    assert len(files) == 6
    for file in files:
        whole = file.read_bytes()
        file.write_bytes(whole[:40] + bytes([whole[40] ^ 1]) + whole[41:])
        (said,) = damages(stored)
        assert file.name in said
        file.write_bytes(whole)
    assert damages(stored) == []


def test_a_truth_that_is_gone_is_named_once_and_the_status_is_1(stored, trackmark):
    (truth,) = stored.glob("_truth/*/*")
    truth.unlink()
    done = trackmark("results", "check", "results", "--json", status=1)
    answer = json.loads(done.stdout)
    assert answer["files"] == 5
    (said,) = answer["damages"]
    assert truth.name in said
    trackmark("results", "remove", "--yes", "--sequence", "Small")  # as is advised
    trackmark(*RUN)
    assert damages(stored) == []


@pytest.mark.slow
def test_a_killed_run_leaves_its_frames_until_it_is_finished(here, trackmark):
    file = here / "slow.py"
    file.write_text((here / "knob.py").read_text().replace("return Estimate", SLOW))
    img = here / "data" / "Small" / "img"
    for number in range(6, 121):
        (img / f"{number:04}.png").write_bytes((img / "0001.png").read_bytes())
    (here / "data" / "Small" / "groundtruth_rect.txt").write_text("5,6,10,12\n" * 120)
    options = ["run", "--trackers", f"{file}:Knob", *MINE]
    process = subprocess.Popen(
        [sys.executable, "-c", "from trackmark.bench.cli import main; main()", *options], cwd=here
    )
    results = here / "results" / "mine"
    deadline = time.monotonic() + 600
    rows = np.empty((0, 6))
    while np.isfinite(rows[:, 0]).sum() < 5:
        assert time.monotonic() < deadline
        time.sleep(0.05)
        for found in results.glob(f"*/*/*{UNFINISHED}"):
            rows = np.load(found)
    process.send_signal(signal.SIGKILL)
    process.wait()
    (left,) = results.glob(f"*/*/*{UNFINISHED}")
    rows = np.load(left)
    assert bench.load_results(results)["status"].tolist() == ["missing"]
    assert (
        f"unfinished, {np.isfinite(rows[:, 0]).sum()} of 120" in trackmark("results", "list").stdout
    )
    kept = left.read_bytes()
    trackmark("results", "remove", "--yes", "--tracker", "slow.py*")
    assert not left.exists()
    left.parent.mkdir(parents=True)
    left.write_bytes(kept)
    trackmark(*options)
    assert not list(results.glob(f"*/*/*{UNFINISHED}"))
    (run,) = Results(results).files()
    reached = int(np.isfinite(rows[:, 0]).sum())
    assert reached >= 5
    np.testing.assert_array_equal(Results(results).read(run).boxes[:reached], rows[:reached, :4])
