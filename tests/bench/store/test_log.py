"""The log: each line is checked by itself, and a torn end is no damage."""

import json

import pytest

from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.log import RunLog, log_files, read_log


@pytest.fixture
def log(tmp_path):
    log = RunLog(tmp_path)
    log.write("start", experiment="trial", runs=3)
    log.write("unit", sequence="a, b", failed=[{"failure": "why\nso"}])
    log.write("end", outcome="finished")
    return log


def test_events_come_back_as_they_were_written(log, tmp_path):
    assert log_files(tmp_path) == [log.path]
    start, unit, end = read_log(log.path)
    assert (start["event"], start["runs"]) == ("start", 3)
    assert unit["failed"] == [{"failure": "why\nso"}]
    assert end["date"] >= start["date"]
    assert all("crc32" in json.loads(line) for line in log.path.read_text().splitlines())


def test_a_log_torn_anywhere_in_its_last_line_tells_what_was_before(log):
    whole = log.path.read_bytes()
    last = whole[:-1].rindex(b"\n") + 1
    for length in range(last, len(whole)):
        log.path.write_bytes(whole[:length])
        assert [event["event"] for event in read_log(log.path)] == ["start", "unit"]


def test_every_changed_byte_of_a_line_is_noticed_and_the_line_named(log):
    whole = log.path.read_bytes()
    first = whole.index(b"\n")
    last = whole[:-1].rindex(b"\n")
    for position in [*range(first), *range(first + 1, last)]:
        broken = bytearray(whole)
        broken[position] ^= 1
        log.path.write_bytes(bytes(broken))
        with pytest.raises(ResultsError, match=r"jsonl, line [12], is damaged"):
            list(read_log(log.path))
