"""What a process has: memory, files, and the state that all trackers in it have in common."""

import os
import random
import resource
import sys
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

_CONTROL_GROUP = Path("/sys/fs/cgroup/memory.max")
_STATUS = Path("/proc/self/status")
_FORGET = Path("/proc/self/clear_refs")


class Surroundings(NamedTuple):
    """State of a process that one tracker could spoil for another."""

    numbers: tuple[Any, ...]  # of the global random generators, which nobody may use
    arithmetic: Mapping[str, Any]  # how floating-point errors are handled
    folder: str
    environment: Mapping[str, str]

    @classmethod
    def now(cls) -> "Surroundings":
        """As it is now."""
        # The old interface, since it is the one that has a state for the whole process.
        name, keys, *rest = np.random.get_state(legacy=True)  # noqa: NPY002
        numbers = (random.getstate(), name, np.asarray(keys).tobytes(), *rest)
        folder = os.getcwd()  # noqa: PTH109  # compared, not used
        return cls(numbers, np.geterr(), folder, dict(os.environ))

    def restore(self) -> None:
        """Put it back."""
        own, name, keys, *rest = self.numbers
        random.setstate(own)
        np.random.set_state((name, np.frombuffer(keys, np.uint32), *rest))  # noqa: NPY002  # as above
        np.seterr(**self.arithmetic)
        os.chdir(self.folder)
        os.environ.clear()
        os.environ.update(self.environment)


def can_use_files() -> bool:
    """Whether this process can still open a file and write into it, apart from any disk.

    A tracker may have used up its descriptors, or set limits to it.
    """
    if not hasattr(os, "memfd_create"):
        return True  # only Linux has files without a disk
    try:
        descriptor = os.memfd_create("trackmark")
    except OSError:
        return False
    try:
        return os.write(descriptor, b"x") == 1
    except OSError:
        return False
    finally:
        os.close(descriptor)


def umask() -> int:
    """What new files of this process are not allowed; it can't be asked for without being set."""
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def machine_memory() -> int:
    """Memory of this machine, or of the container that this process is in, in bytes."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if _CONTROL_GROUP.is_file():
        allowed = _CONTROL_GROUP.read_text("utf-8").strip()
        if allowed != "max":
            memory = min(memory, int(allowed))
    return memory


def limit_memory(number: int) -> None:
    """Let this process and its children have so many bytes of data each, and no more.

    What asks for more gets a `MemoryError`, or what its library makes of it.
    """
    _, most = resource.getrlimit(resource.RLIMIT_DATA)
    allowed = number if most == resource.RLIM_INFINITY else min(number, most)
    resource.setrlimit(resource.RLIMIT_DATA, (allowed, most))


def reset_peak() -> None:
    """Forget earlier peaks, where the system can."""
    with suppress(OSError):  # elsewhere the peak is that of the process's whole life
        _FORGET.write_text("5", "ascii")


def peak_memory() -> int:
    """Most memory that this process has had since `reset_peak`, in bytes."""
    if _STATUS.is_file():
        for line in _STATUS.read_text("ascii", "replace").splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else most * 1024
