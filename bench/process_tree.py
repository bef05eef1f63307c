"""Child processes that are ended with all their descendants."""

import os
import signal
import subprocess
import sys
import uuid
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

_END_SECONDS = 10.0
_MARK = "TRACKMARK_CHILD"
_HOME = str(Path(__file__).parents[2])  # folder of the package `trackmark`
# Import this installation, not another one that is earlier in the path.
_CODE = (
    "import sys; home = sys.argv.pop(1); home in sys.path or sys.path.insert(0, home); "
    "from {module} import main; main()"
)


def in_child() -> bool:
    """Return whether trackmark has started this process, directly or indirectly."""
    return any(name.startswith(f"{_MARK}_") for name in os.environ)


class ProcessTree:
    """Process of a command, in its own session; `process` is an object of `subprocess.Popen`.

    `environment` is added to the environment of this process. `options` are further arguments of
    `subprocess.Popen`.
    """

    def __init__(
        self, command: Sequence[str], environment: Mapping[str, str] | None = None, **options: Any
    ) -> None:
        # Each tree has its own variable, so that nested trees do not hide one another.
        self._mark = f"{_MARK}_{uuid.uuid4().hex}"
        self.process: subprocess.Popen[bytes] = subprocess.Popen(  # noqa: S603  # by the user
            command,
            env={**os.environ, **(environment or {}), self._mark: "1"},
            # In its own session, the process does not receive signals for this command.
            start_new_session=True,
            **options,
        )

    @classmethod
    def run_module(cls, module: str, arguments: Iterable[object], **options: Any) -> "ProcessTree":
        """Call `main` of a module in a new process, with `arguments` in `sys.argv`."""
        code = _CODE.format(module=module)
        command = [sys.executable, "-P", "-c", code, _HOME, *map(str, arguments)]
        return cls(command, **options)

    def end(self) -> None:
        """Kill the process and all processes that it has started."""
        self.process.send_signal(signal.SIGSTOP)  # a stopped process cannot start others
        for number in _started_by(self.process.pid, self._mark):
            with suppress(ProcessLookupError):
                os.kill(number, signal.SIGKILL)
        with suppress(ProcessLookupError, PermissionError):  # the session has already ended
            os.killpg(self.process.pid, signal.SIGKILL)
        with suppress(subprocess.TimeoutExpired):  # waits for a lost disk
            self.process.wait(_END_SECONDS)


def _started_by(parent: int, mark: str) -> list[int]:
    """Return the ids of a process's descendants; `mark` is in the environment they inherit.

    A descendant is missed if its environment lacks the mark and its ancestors have ended.
    """
    parents: dict[int, int] = {}
    numbers: set[int] = set()
    wanted = f"{mark}=1".encode()
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # the process has ended, or belongs to another user
            number = int(folder.name)
            state = (folder / "stat").read_text("utf-8", "replace")
            parents[number] = int(state.rpartition(")")[2].split()[1])
            if wanted in (folder / "environ").read_bytes().split(b"\0"):
                numbers.add(number)
    newer = {parent, *numbers}
    while newer := {child for child, creator in parents.items() if creator in newer} - numbers:
        numbers |= newer
    return sorted(numbers - {parent})
