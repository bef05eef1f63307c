"""Commands in sessions of their own, and all the processes that they start."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from uuid import uuid4

import pytest

from trackmark.bench.store.run_store import RunStore, run_arrays

TRACKMARK = [sys.executable, "-c", "from trackmark.bench.cli import main; main()"]


class Command:
    """Running command in its own session; `variables` are added to its environment."""

    def __init__(self, arguments, folder, **variables):
        self._mark = uuid4().hex
        self.process = subprocess.Popen(
            arguments,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            # A background job ignores SIGINT; a command in a terminal does not.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            env=os.environ | {"TRACKMARK_MARK": self._mark} | variables,
        )
        self.stdout = self.stderr = ""

    def wait(self, seconds=600):
        """Wait for the end of the command and return its exit status."""
        self.stdout, self.stderr = self.process.communicate(timeout=seconds)
        return self.process.returncode

    def living(self):
        """Return the ids of the living processes of the command, detached ones included."""
        numbers = []
        for place in Path("/proc").glob("[0-9]*"):
            try:
                state = (place / "stat").read_text().rpartition(")")[2].split()[0]
                if state not in "ZX" and self._mark.encode() in (place / "environ").read_bytes():
                    numbers.append(int(place.name))
            except OSError:  # the process has ended
                continue
        return sorted(numbers)

    def workers(self):
        """Return the ids of the living worker processes of the command."""
        return [
            number
            for number in self.living()
            if "trackmark.bench.execution.worker" in command_line(number)
        ]

    def kill(self):
        """Kill all processes that the command has started."""
        for number in self.living():
            send(number, signal.SIGKILL)
        self.process.communicate()


def command_line(number):
    try:
        return Path(f"/proc/{number}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except OSError:
        return ""


def send(number, signal_number):
    """Send a signal and return whether the process still existed."""
    try:
        os.kill(number, signal_number)
    except ProcessLookupError:
        return False
    return True


@pytest.fixture(scope="session")
def begin():
    """Return a function that starts a command; all are killed at the end of the session."""
    commands = []

    def begin_command(*arguments, **variables):
        commands.append(Command(*arguments, **variables))
        return commands[-1]

    yield begin_command
    for command in commands:
        if command.process.poll() is None:
            command.kill()


@pytest.fixture(scope="session")
def wait_until():
    """Return a function that waits until a condition holds and fails after a time limit."""

    def wait(condition, seconds=600):
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, "the condition did not hold in time"
            time.sleep(0.05)

    return wait


@pytest.fixture(scope="session")
def contents():
    """Return a function that reads identity, failure and columns of all runs, by run key."""

    def read_contents(folder):
        results = RunStore(folder)
        contents_by_key = {}
        for cell in results.list_keys():
            run = results.read(cell)
            columns = {name: values.tobytes() for name, values in run_arrays(run).items()}
            contents_by_key[cell] = (run.identity, run.failure, columns)
        return contents_by_key

    return read_contents
