"""Commands in sessions of their own, and all the processes that they start."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from uuid import uuid4

import pytest

from trackmark.bench.store.results import Results, run_columns

TRACKMARK = [sys.executable, "-c", "from trackmark.bench.cli import main; main()"]

TRACKMARK = [sys.executable, "-c", "from trackmark.bench.cli import main; main()"]


class Command:
    """A command that runs, in a session of its own.

    Parameters
    ----------
    arguments : list of str
        What is typed.
    folder : Path
        Where.
    surroundings : str
        Environment variables.
    """

    def __init__(self, arguments, folder, **surroundings):
        self._mark = uuid4().hex
        self.process = subprocess.Popen(
            arguments,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            # A terminal's child listens to Ctrl-C; one of a job in the background does not.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            env=os.environ | {"TRACKMARK_MARK": self._mark} | surroundings,
        )
        self.said = self.complained = ""

    def wait(self, seconds=600):
        """Wait for its end; give its exit status."""
        self.said, self.complained = self.process.communicate(timeout=seconds)
        return self.process.returncode

    def living(self):
        """Numbers of living processes that it has started, wherever they went, and its own."""
        found = []
        for place in Path("/proc").glob("[0-9]*"):
            try:
                state = (place / "stat").read_text().rpartition(")")[2].split()[0]
                if state not in "ZX" and self._mark.encode() in (place / "environ").read_bytes():
                    found.append(int(place.name))
            except OSError:  # it has ended
                continue
        return sorted(found)

    def workers(self):
        """Numbers of its living processes in which trackers run."""
        return [
            number
            for number in self.living()
            if "trackmark.bench.engine.worker" in command_line(number)
        ]

    def kill(self):
        """Kill all that it has started."""
        for number in self.living():
            send(number, signal.SIGKILL)
        self.process.communicate()


def command_line(number):
    try:
        return Path(f"/proc/{number}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except OSError:
        return ""


def send(number, what):
    """Send a signal, if there is still somebody."""
    try:
        os.kill(number, what)
    except ProcessLookupError:
        return False
    return True


@pytest.fixture(scope="session")
def begin():
    """Begin a command; see `Command`. All are killed in the end."""
    begun = []

    def begin_one(*arguments, **surroundings):
        begun.append(Command(*arguments, **surroundings))
        return begun[-1]

    yield begin_one
    for command in begun:
        if command.process.poll() is None:
            command.kill()


@pytest.fixture(scope="session")
def wait_until():
    """Wait until a condition holds, and fail when it takes too long."""

    def wait(condition, seconds=600):
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, "waited in vain"
            time.sleep(0.05)

    return wait


@pytest.fixture(scope="session")
def contents():
    """Everything that determines and says a run, by path."""

    def of(folder):
        results = Results(folder)
        found = {}
        for cell in results.list_keys():
            run = results.read(cell)
            columns = {name: values.tobytes() for name, values in run_columns(run).items()}
            found[cell] = (run.identity, run.failure, columns)
        return found

    return of
