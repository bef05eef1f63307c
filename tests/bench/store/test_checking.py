"""`results check` names what is damaged or missing; frames of an unfinished run are kept."""

import json

import pytest

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
