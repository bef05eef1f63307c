"""Memory of this process: how much it may have, and how much it has had."""

import resource
import sys
from contextlib import suppress
from pathlib import Path

__all__ = ["limit_memory", "peak_memory", "reset_peak"]

_STATUS = Path("/proc/self/status")
_FORGET = Path("/proc/self/clear_refs")


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
