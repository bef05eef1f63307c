"""Processes of external trackers: lines, time limits, failures and their end."""

import os
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from trackmark.bench.external import process as process_module
from trackmark.bench.external.process import ExternalTrackerError, LineProcess


@pytest.fixture(autouse=True)
def _real_clock(hangs, monkeypatch):
    monkeypatch.setattr(process_module, "monotonic", time.monotonic)


def start(code, **options):
    return LineProcess([sys.executable, "-c", code], b"@@", **options)


def assert_ended(pid):
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_process_exchanges_marked_lines(tmp_path):
    """Both sides can write more than a pipe holds before they read."""
    code = (
        "import os; print('log', os.environ['MODE'], os.getcwd()); print('@@' + 'a' * 300_000); "
        "print('@@', len(input()), '\\r', flush=True); input()"
    )
    process = start(code, environment={"MODE": "x"}, folder=tmp_path)
    process.send(b"b" * 300_000 + b"\n", 60)
    assert len(process.read_line(60)) == 300_002
    assert process.read_line(60) == b"@@ 300000 "
    assert f"stops. Its last line: log x {tmp_path}" in str(process.fail("stops"))


FAILURES = {
    "import sys; sys.exit('é' * 10**6 + '\\nno torch')": "status 1. Its last line: no torch\nThe",
    "import os; print('x', flush=True); os._exit(7)": "status 7. Its last line: x\nThe end of",
    "import os; input(); os.kill(os.getpid(), 11)": "ended by signal 11 (Segmentation fault)",
    "import os, time; input(); os.close(1); time.sleep(99)": "closed its stdout",
    "import os\nwhile True: os.write(1, bytes(1 << 16))": "more than 64 MiB without a line end",
    "import time; input(); time.sleep(99)": "did not answer in 0.5 s",
    "input()\nwhile True: print('noise')": "did not answer in 0.5 s. Its last line: noise",
    "import time; time.sleep(99)": "did not read its input in 0.5 s",
}


@pytest.mark.parametrize("code", FAILURES)
def test_failure_names_command_end_and_last_output(code, monkeypatch):
    """Neither a hang nor output without an answer extends a time limit."""
    monkeypatch.setattr(process_module, "_EXIT_SECONDS", 1.0)
    process, words = start(code), FAILURES[code]

    def ask():
        process.send(b"x" * (1 << 20) + b"\n", 0.5 if "did not read" in words else 60)
        process.read_line(0.5 if "did not answer" in words else 60)

    with pytest.raises(ExternalTrackerError) as raised:
        ask()
    text = str(raised.value)
    assert text.startswith(f"{process.command}: the process ")
    assert words in text
    assert len(text.partition("output:\n")[2]) <= 2000
    assert_ended(process.process.pid)
    with pytest.raises(ExternalTrackerError, match="the process has ended"):
        process.send(b"\n", 60)


def test_output_that_is_kept_is_limited():
    process = start("import sys\nfor line in sys.stdin: print('y' * 50_000 + '@@', flush=True)")
    for _ in range(9):
        process.send(b"\n", 60)
        assert process.read_line(60) == b"@@"
    process.send(b"\n" * 9, 60)
    assert len(process._output._bytes) < 10_000
    process.close()


@pytest.mark.parametrize("way", ["close", "collect"])
def test_no_process_is_left(way):
    """Descendants end with the process, even those in another session."""
    code = (
        "import subprocess, sys; child = subprocess.Popen([sys.executable, '-c', "
        "'import time; time.sleep(999)'], start_new_session=True); "
        "print('@@', child.pid, flush=True); input()"
    )
    process = start(code)
    pid, child = process.process.pid, Path("/proc") / process.read_line(60).decode()[3:] / "stat"
    if way == "close":
        process.close()
        process.close()
    del process
    assert_ended(pid)
    limit = time.monotonic() + 60
    with suppress(FileNotFoundError):  # init reaps the descendant
        while ") Z " not in child.read_text("utf-8"):
            assert time.monotonic() < limit
            time.sleep(0.01)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs the states of Linux")
def test_clock_starts_when_the_process_waits(monkeypatch):
    """The process works after its answer; this is not part of the next request."""
    monkeypatch.setattr(process_module, "_READY_SECONDS", 60.0)
    work = "while time.process_time() < 0.5: pass\n"
    process = start(f"import time\ninput()\nprint('@@', flush=True)\n{work}input()")
    process.send(b"\n", 60)
    process.read_line(60)
    process.wait_until_ready()
    assert process.counters().cpu >= 0.5
    process.close()
