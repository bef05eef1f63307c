"""Processes of these very packages: begun alike, and ended with all that they have started."""

import os
import signal
import subprocess
import sys
import uuid
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

_END_SECONDS = 10.0
_MARK = "TRACKMARK_CHILD"
_HOME = str(Path(__file__).parents[2])  # contains the package `trackmark`
# These very packages, wherever the process would look for them first.
_CODE = (
    "import sys; home = sys.argv.pop(1); home in sys.path or sys.path.insert(0, home); "
    "from {module} import main; main()"
)


class Offspring:
    """A process that calls `main` of a module.

    `module`: its full name. `arguments`: of the command line. `how`: further arguments of
    `subprocess.Popen`. `process` is what that gives.
    """

    def __init__(self, module: str, arguments: Iterable[object], **how: Any) -> None:
        self._mark = uuid.uuid4().hex
        code = _CODE.format(module=module)
        self.process: subprocess.Popen[bytes] = subprocess.Popen(  # noqa: S603  # ourselves
            [sys.executable, "-P", "-c", code, _HOME, *map(str, arguments)],
            env=os.environ | {_MARK: self._mark},
            # In a session of its own it is reached by no signal that is for this command.
            start_new_session=True,
            **how,
        )

    def end(self) -> None:
        """Kill it, and what it has started, wherever that has gone."""
        self.process.send_signal(signal.SIGSTOP)  # nothing more is started from now on
        for number in _started_by(self.process.pid, self._mark):
            with suppress(ProcessLookupError):
                os.kill(number, signal.SIGKILL)
        with suppress(ProcessLookupError, PermissionError):  # nobody of its session is left
            os.killpg(self.process.pid, signal.SIGKILL)
        with suppress(subprocess.TimeoutExpired):  # one that waits for a lost disk can't end
            self.process.wait(_END_SECONDS)


def _started_by(parent: int, mark: str) -> list[int]:
    """Numbers of a process's descendants, and of those that inherited its mark, where one can see.

    What has neither its mark in its environment nor a living ancestor in it can't be found.
    """
    parents: dict[int, int] = {}
    found: set[int] = set()
    wanted = f"{_MARK}={mark}".encode()
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # it has just ended, or is somebody else's
            number = int(folder.name)
            state = (folder / "stat").read_text("utf-8", "replace")
            parents[number] = int(state.rpartition(")")[2].split()[1])
            if wanted in (folder / "environ").read_bytes().split(b"\0"):
                found.add(number)
    newer = {parent, *found}
    while newer := {child for child, of in parents.items() if of in newer} - found:
        found |= newer
    return sorted(found - {parent})
