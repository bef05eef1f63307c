"""Compilation of kernels by Numba: a message for the user, and a lock between processes.

The first compilation takes seconds. Numba caches compiled kernels on disk, where several processes
can read and write at the same time.
"""

import sys
from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import cache, wraps
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

from trackmark.bench.operating_system import lock_file

SENTENCE = "Compiling kernels that this machine has not used yet; later runs use the compiled ones."


@cache
def log_compilation() -> None:
    """Log that kernels are compiled, once per process; by default to standard error."""
    import logging

    logging.getLogger("trackmark").warning(SENTENCE)


def prepare_numba(on_compile: Callable[[], None] = lambda: None) -> None:
    """Call `on_compile` whenever Numba starts a compilation, and lock Numba's cache on disk.

    This takes effect when Numba is imported; processes without kernels do not import it.
    """
    sys.meta_path.insert(0, _NumbaFinder(on_compile))


class _NumbaFinder:
    """Finder for Numba's module, which adds the callback and the lock after the import."""

    def __init__(self, on_compile: Callable[[], None]) -> None:
        self._on_compile = on_compile

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        """See `importlib.abc.MetaPathFinder`."""
        if fullname != "numba":
            return None
        sys.meta_path.remove(self)
        spec = find_spec(fullname)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_and_prepare(module: ModuleType) -> None:
                execute(module)
                _prepare(self._on_compile)

            spec.loader.exec_module = execute_and_prepare  # type: ignore[method-assign]  # patches this instance
        return spec


def _prepare(on_compile: Callable[[], None]) -> None:
    """Register the callback, and make Numba lock a function's cache when it reads or writes it.

    Numba writes the index of compiled kernels before their files. Without the lock, another process
    could read an older kernel, or one for other types, in between.
    """
    from numba.core import event
    from numba.core.caching import IndexDataCacheFile

    class Listener(event.Listener):
        def on_start(self, happened: Any) -> None:
            on_compile()

        def on_end(self, happened: Any) -> None:
            pass

    event.register("numba:compile", Listener())  # type: ignore[no-untyped-call]  # Numba's
    for name in ("load", "save"):
        setattr(IndexDataCacheFile, name, _locked(getattr(IndexDataCacheFile, name)))


def _locked(call: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(call)
    def alone(cache: Any, *arguments: Any) -> Any:
        with ExitStack() as lock:
            with suppress(OSError):  # a read-only folder has no writers
                file = lock.enter_context(Path(f"{cache._index_path}.lock").open("ab"))
                lock_file(file.fileno())
            return call(cache, *arguments)

    return alone
