"""Telling the user while Numba compiles a kernel for the first time, which takes seconds.

Numba keeps what it has compiled on disk, so that later commands start at once.
"""

import sys
from collections.abc import Callable
from functools import cache
from typing import Any

__all__ = ["SENTENCE", "announce", "on_compilation"]

SENTENCE = "Compiling kernels that are used here for the first time; later runs find them compiled."


@cache
def announce() -> None:
    """Say so once a process: a line on standard error, unless logging was set up otherwise."""
    import logging

    logging.getLogger("trackmark").warning(SENTENCE)


def on_compilation(tell: Callable[[], None]) -> None:
    """Have something called whenever Numba begins to compile what is not on disk.

    Numba is not imported for it: a process that has no kernels to run does not wait for it.
    """
    sys.meta_path.insert(0, _Attendant(tell))


class _Attendant:
    """A finder of modules that finds none, but notices when Numba's compiler is about to come."""

    def __init__(self, tell: Callable[[], None]) -> None:
        self._tell = tell

    def find_spec(self, fullname: str, path: object, target: object = None) -> None:
        """See `importlib.abc.MetaPathFinder`."""
        if fullname == "numba.core.dispatcher":
            sys.meta_path.remove(self)
            _listen(self._tell)


def _listen(tell: Callable[[], None]) -> None:
    from numba.core import event

    class Listener(event.Listener):
        def on_start(self, happened: Any) -> None:
            tell()

        def on_end(self, happened: Any) -> None:
            pass

    event.register("numba:compile", Listener())  # type: ignore[no-untyped-call]  # Numba's
