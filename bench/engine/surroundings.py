"""What trackers in one process have in common, and must leave as it is."""

import os
import random
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

__all__ = ["Surroundings", "can_use_files"]


class Surroundings(NamedTuple):
    """State of a process that one tracker could spoil for another.

    Attributes
    ----------
    numbers : tuple
        Of the global random generators, which nobody may use.
    arithmetic : mapping
        How floating-point errors are handled.
    folder : str
        Working directory.
    environment : mapping
        Environment variables.
    """

    numbers: tuple[Any, ...]
    arithmetic: Mapping[str, Any]
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
