"""Child processes that are ended with all their descendants."""

import os
import subprocess
import sys
import uuid
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from trackmark.bench.operating_system import kill_process_tree

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
        kill_process_tree(self.process, self._mark)
