"""Processes of external trackers: lines, time limits, failures and their end."""

import os
import sys
import time
from pathlib import Path

import pytest

from trackmark.bench.external.process import ExternalTrackerError, LineProcess


def _start(code: str, **options: object) -> LineProcess:
    return LineProcess([sys.executable, "-c", code], **options)  # type: ignore[arg-type]


def _ask(process: LineProcess, seconds: float) -> bytes:
    process.send(b"x" * (1 << 20) + b"\n", seconds)
    return process.read_line(seconds)


def _failure(code: str, seconds: float = 60.0) -> str:
    """Return the error of a request to a process that runs `code`."""
    process = _start(code)
    with pytest.raises(ExternalTrackerError) as raised:
        _ask(process, seconds)
    assert str(raised.value).startswith(process.command)
    _assert_ended(process._process.pid)
    return str(raised.value)


def _assert_ended(pid: int) -> None:
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_read_line_returns_marked_lines():
    """Lines without the mark are skipped; a carriage return is removed."""
    process = _start("print('log'); print('@@A 1\\r\\n@@A', input(), flush=True); input()")
    process.send(b"hello\n", 60)
    assert process.read_line(60, mark=b"@@") == b"@@A 1"
    assert process.read_line(60, mark=b"@@") == b"@@A hello"
    assert "log" in str(process.fail("failed"))


def test_environment_and_folder_reach_the_process(tmp_path: Path):
    """The environment is an addition to that of this process."""
    code = "import os; print(os.environ['MODE'], os.environ['PATH'], os.getcwd())"
    process = _start(code, environment={"MODE": "x"}, folder=tmp_path)
    assert process.read_line(60).decode() == f"x {os.environ['PATH']} {tmp_path}"
    process.close()


ENDS = {
    "import sys; input(); sys.exit('no GPU')": ("ended with status 1", "no GPU"),
    "import os; os._exit(7)": ("ended with status 7", ""),
    "import os; input(); os.kill(os.getpid(), 11)": ("ended by signal 11", ""),
    "import os, time; os.close(1); time.sleep(99)": ("closed its stdout", ""),
    "import os\nwhile True: os.write(1, bytes(1 << 16))": ("more than 64 MiB", ""),
}


@pytest.mark.parametrize("code", ENDS)
def test_failure_names_status_and_output(code: str, monkeypatch: pytest.MonkeyPatch):
    """An error names the command, how the process ended, and its last output."""
    monkeypatch.setattr("trackmark.bench.external.process._EXIT_SECONDS", 1.0)
    end, output = ENDS[code]
    text = _failure(code)
    assert end in text
    assert output in text


@pytest.mark.parametrize(
    "code",
    [
        "import time; input(); time.sleep(99)",
        "input()\nwhile True: print('noise')",
        "import os; input()\nwhile True: os.write(2, b'noise\\n')",
    ],
)
def test_silence_and_noise_exceed_the_time_limit(code: str):
    """Neither a hang nor output without an answer extends the time limit."""
    process = _start(code)
    process.send(b"\n", 60)
    with pytest.raises(ExternalTrackerError, match=r"did not answer in 0.5 s"):
        process.read_line(0.5, mark=b"@@")
    _assert_ended(process._process.pid)


def test_unread_input_exceeds_the_time_limit():
    """A process that never reads cannot block the harness."""
    assert "did not read its input in 0.5 s" in _failure("import time; time.sleep(99)", 0.5)


def test_output_while_input_is_written_causes_no_deadlock():
    """Both sides can write more than a pipe holds."""
    process = _start("print('a' * 300_000, flush=True); print(len(input()), flush=True); input()")
    process.send(b"b" * 300_000 + b"\n", 60)
    assert len(process.read_line(60)) == 300_000
    assert process.read_line(60) == b"300000"
    process.close()


def test_error_has_the_last_line_and_the_end_of_the_output():
    """The last line comes first, because lists of failures show only the start of an error."""
    text = _failure("import sys; sys.exit('é' * 10**6 + '\\nNo module named torch')")
    assert "the process ended with status 1. Its last line: No module named torch The end" in text
    assert text.endswith("\nNo module named torch")
    assert len(text.rpartition("output:\n")[2]) < 2_001


def test_command_that_cannot_be_started_is_named():
    """A wrong path is an error of the command."""
    with pytest.raises(ExternalTrackerError, match=r"no/such --fast: .*cannot be started.*No such"):
        LineProcess(["no/such", "--fast"])


@pytest.mark.parametrize("way", ["close", "collect"])
def test_no_process_is_left(way: str):
    """Descendants end with the process, even those in another session."""
    code = (
        "import subprocess, sys; child = subprocess.Popen([sys.executable, '-c', "
        "'import time; time.sleep(999)'], start_new_session=True); "
        "print(child.pid, flush=True); input()"
    )
    process = _start(code)
    pids = [process._process.pid, int(process.read_line(60))]
    if way == "close":
        process.close()
        process.close()
    del process
    limit = time.monotonic() + 60
    while _running(pids[1]) and time.monotonic() < limit:  # init reaps the descendant
        time.sleep(0.01)
    _assert_ended(pids[0])
    assert not _running(pids[1])


def _running(pid: int) -> bool:
    try:
        return ") Z " not in Path(f"/proc/{pid}/stat").read_text("utf-8")
    except FileNotFoundError:
        return False


def test_close_lets_the_process_end_by_itself(tmp_path: Path):
    """With a grace period, exit handlers of the tracker run."""
    file = tmp_path / "end"
    process = _start(f"import sys; sys.stdin.read(); open({str(file)!r}, 'w')")
    process.close(seconds=60)
    assert file.exists()
