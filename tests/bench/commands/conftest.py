"""Helpers for the tests of commands: parsers of printed output, trackers in this process."""

import csv
import io
import json
import re
from functools import cache
from importlib import metadata
from types import SimpleNamespace

import pytest

from trackmark.bench.external import close_idle_processes, isolated
from trackmark.bench.external.isolated_worker import IsolatedTrackers
from trackmark.bench.external.worker import convert
from trackmark.bench.external.worker_process import WorkerProcess
from trackmark.trackers import TrackerError

SMALL = ("--sequences", "data/Small")
TINY = "plain/target:length=12:width=64:height=64"


def json_lines(done):
    """Return the objects that a command printed, one per line; none of them holds NaN."""

    def refuse(constant):
        raise AssertionError(f"{constant} is not JSON")

    return [json.loads(line, parse_constant=refuse) for line in done.stdout.splitlines()]


def masked(text):
    """Return a text with single spaces, and with letters in place of measured times."""
    text = re.sub(r"[\d.]+ (ms|s)\b", r"N \1", re.sub(r"\d\d:\d\d:\d\d", "HH:MM:SS", text))
    text = re.sub(r"( px) +~?[\d.]+ +[\d.]+$", r"\1  N  N", text, flags=re.MULTILINE)
    text = re.sub(r"^ms/frame on .*$", "ms/frame on MACHINE", text, flags=re.MULTILINE)
    # Other load can lead to this note.
    text = re.sub(r"^.*a few frames take most of the time.*\n", "", text, flags=re.MULTILINE)
    return re.sub(r" +$", "", re.sub("  +", "  ", text), flags=re.MULTILINE)


def assert_tables_have_rows(folder):
    """Assert that each table of a folder has as many or more rows in CSV as in Markdown."""
    tables = {file: file.with_suffix(".md") for file in folder.glob("*.csv")}
    assert tables
    for file, markdown in tables.items():
        # Two lines with a pipe are the headings.
        rows_in_markdown = [
            line for line in markdown.read_text().splitlines() if line.startswith("|")
        ][2:]
        with file.open(newline="") as text:
            rows = list(csv.DictReader(text))
        assert rows or not rows_in_markdown, file.name
        assert all(any(row.values()) for row in rows), file.name


def unwrapped(text):
    """Return a text without its line breaks."""
    return " ".join(text.split())


@pytest.fixture(autouse=True, scope="module")
def cached_entry_points():
    """Look up entry points once per module: a lookup takes 20 ms, and each command has several."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(metadata, "entry_points", cache(metadata.entry_points))
        yield


class InProcessWorker(WorkerProcess):
    """Worker that runs a tracker of a file in this process, which saves the start of another."""

    def __init__(self, operations, **options):
        self._frames = io.BytesIO()
        self._operations = IsolatedTrackers(self._frames)
        self._operations.copies = SimpleNamespace(end=lambda: None)
        self.is_usable = True
        self.n_requests = 0
        self.process = SimpleNamespace(poll=lambda: None)

    def ask(self, seconds, operation, **arguments):
        self.n_requests += 1
        arguments = json.loads(json.dumps(arguments, default=int))
        self._frames.seek(0)
        reply = self._operations.perform(operation, **arguments)
        if "unusable" in (reply or {}):
            raise TrackerError(reply["unusable"])
        self.is_usable = not {"invalid", "raised"} & {*(reply or {})}
        return json.loads(json.dumps(reply, default=convert))

    def printed(self):
        return ""

    end_output = forget_output = printed

    def close(self):
        self._frames.close()


@pytest.fixture
def tracker_processes():
    """Run trackers of files in processes of their own, as commands do."""


@pytest.fixture(autouse=True)
def trackers_in_this_process(request, monkeypatch):
    """Run trackers of files in this process, except in tests that use `tracker_processes`."""
    if "tracker_processes" not in request.fixturenames:
        monkeypatch.setattr(isolated, "WorkerProcess", InProcessWorker)
        yield
        close_idle_processes()
    else:
        yield
