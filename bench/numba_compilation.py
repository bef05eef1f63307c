"""Compilation of kernels by Numba: an announcement for the user, and a lock between processes.

The first compilation takes seconds. Numba caches compiled kernels on disk, where several processes
may read and write at the same time.
"""

import fcntl
import sys
from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import cache, wraps
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

SENTENCE = "Compiling kernels that are used here for the first time; later runs find them compiled."


@cache
def announce() -> None:
    """Log `SENTENCE` once per process: to standard error, unless logging is set up otherwise."""
    import logging

    logging.getLogger("trackmark").warning(SENTENCE)


def attend(tell: Callable[[], None] = lambda: None) -> None:
    """Call `tell` whenever Numba begins to compile, and lock its cache on disk.

    Numba is not imported here: a process without kernels need not wait for it.
    """
    sys.meta_path.insert(0, _Attendant(tell))


class _Attendant:
    """Finder of modules that finds only Numba, and registers the two as soon as it is imported."""

    def __init__(self, tell: Callable[[], None]) -> None:
        self._tell = tell

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        """See `importlib.abc.MetaPathFinder`."""
        if fullname != "numba":
            return None
        sys.meta_path.remove(self)
        spec = find_spec(fullname)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def attended(module: ModuleType) -> None:
                execute(module)
                _listen(self._tell)
                _guard()

            spec.loader.exec_module = attended  # type: ignore[method-assign]  # this one's
        return spec


def _listen(tell: Callable[[], None]) -> None:
    from numba.core import event

    class Listener(event.Listener):
        def on_start(self, happened: Any) -> None:
            tell()

        def on_end(self, happened: Any) -> None:
            pass

    event.register("numba:compile", Listener())  # type: ignore[no-untyped-call]  # Numba's


def _guard() -> None:
    """Let only one process at a time read or write the cache of a function.

    Numba stores which file holds which compiled kernel before it writes that file: meanwhile
    another process would run an older kernel, or one for other types.
    """
    from numba.core.caching import IndexDataCacheFile

    for name in ("load", "save"):
        setattr(IndexDataCacheFile, name, _locked(getattr(IndexDataCacheFile, name)))


def _locked(call: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(call)
    def alone(cache: Any, *arguments: Any) -> Any:
        with ExitStack() as lock:
            with suppress(OSError):  # a folder that can only be read has no writers
                file = lock.enter_context(Path(f"{cache._index_path}.lock").open("ab"))
                fcntl.flock(file, fcntl.LOCK_EX)
            return call(cache, *arguments)

    return alone
