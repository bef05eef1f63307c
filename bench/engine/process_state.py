"""State that all trackers of a process share, and memory of the process."""

import os
import random
import resource
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

_CONTROL_GROUP = Path("/sys/fs/cgroup/memory.max")


class ProcessState(NamedTuple):
    """State of a process, through which one tracker can affect another."""

    numbers: tuple[Any, ...]  # state of the global random generators
    arithmetic: Mapping[str, Any]  # handling of floating-point errors
    folder: str
    environment: Mapping[str, str]
    umask: int

    @classmethod
    def current(cls) -> "ProcessState":
        """Return the current state."""
        # Only the legacy interface has a state for the whole process.
        name, keys, *rest = np.random.get_state(legacy=True)  # noqa: NPY002
        numbers = (random.getstate(), name, np.asarray(keys).tobytes(), *rest)
        folder = os.getcwd()  # noqa: PTH109  # compared, not used
        umask = os.umask(0o077)  # the mask can only be read by setting it
        os.umask(umask)
        return cls(numbers, np.geterr(), folder, dict(os.environ), umask)

    def restore(self) -> None:
        """Set the process to this state."""
        python_state, name, keys, *rest = self.numbers
        random.setstate(python_state)
        np.random.set_state((name, np.frombuffer(keys, np.uint32), *rest))  # noqa: NPY002  # as above
        np.seterr(**self.arithmetic)
        os.chdir(self.folder)
        os.environ.clear()
        os.environ.update(self.environment)
        os.umask(self.umask)


def can_open_files() -> bool:
    """Return whether this process can open another file."""
    try:
        os.close(os.open(os.devnull, os.O_RDONLY))
    except OSError:
        return False
    return True


def machine_memory() -> int:
    """Return the memory of this machine or container [bytes]."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if _CONTROL_GROUP.is_file():
        allowed = _CONTROL_GROUP.read_text("utf-8").strip()
        if allowed != "max":
            memory = min(memory, int(allowed))
    return memory


def limit_memory(number: int) -> None:
    """Limit the data memory of this process, and of each child process, to a number of bytes.

    An allocation beyond the limit raises `MemoryError`, or another error of the allocating library.
    """
    _, most = resource.getrlimit(resource.RLIMIT_DATA)
    allowed = number if most == resource.RLIM_INFINITY else min(number, most)
    resource.setrlimit(resource.RLIMIT_DATA, (allowed, most))
