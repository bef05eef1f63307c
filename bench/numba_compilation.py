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
    """Call `on_compile` for each compilation by Numba, and let one process compile a kernel.

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
                _register_callback(self._on_compile)
                _lock_cache(self._on_compile)

            spec.loader.exec_module = execute_and_prepare  # type: ignore[method-assign]  # patches this instance
        return spec


def _register_callback(on_compile: Callable[[], None]) -> None:
    from numba.core import event

    class Listener(event.Listener):
        def on_start(self, happened: Any) -> None:
            on_compile()

        def on_end(self, happened: Any) -> None:
            pass

    event.register("numba:compile", Listener())  # type: ignore[no-untyped-call]  # Numba's


def _lock_cache(on_compile: Callable[[], None]) -> None:
    """Make Numba lock the cache of a kernel while one process looks it up, compiles and stores it.

    Workers start with the same kernels at the same time. Without the lock, each would compile all
    of them. One could also read an older kernel, or one for other types, because Numba writes the
    index of compiled kernels before their files. Waiting for a kernel calls `on_compile`, too, so
    that it does not count as a tracker's time.
    """
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.dispatcher import Dispatcher

    compile_or_load = Dispatcher.compile
    if hasattr(compile_or_load, "__wrapped__"):  # by an earlier call of `prepare_numba`
        return  # a second lock of the same file would wait for the first one

    @wraps(compile_or_load)
    def compile_alone(kernel: Any, *arguments: Any) -> Any:
        # Threads take Numba's own lock first, so that none waits for a file that another holds.
        with global_compiler_lock, ExitStack() as lock:
            file = getattr(kernel._cache, "_cache_file", None)
            if file is not None:
                with suppress(OSError):  # a read-only folder has no writers
                    locked = lock.enter_context(Path(f"{file._index_path}.lock").open("ab"))
                    try:
                        lock_file(locked.fileno(), wait=False)
                    except OSError:
                        on_compile()
                        lock_file(locked.fileno())
            return compile_or_load(kernel, *arguments)

    Dispatcher.compile = compile_alone  # type: ignore[method-assign,assignment]  # Numba's
