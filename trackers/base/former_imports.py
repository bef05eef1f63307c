"""Deprecated import names `trackers`, `datasets`, `bench` and `reports` of tracker files.

In earlier releases, these were top-level packages. The finder maps each name to the package in
`trackmark`, unless another installed package has this name. `warn_of_former_imports` logs a
warning.
"""

import ast
import importlib
import logging
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import cache
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import spec_from_loader
from pathlib import Path
from types import ModuleType

NAMES = ("bench", "datasets", "reports", "trackers")
_HOME = Path(__file__).resolve().parents[2]


class _Finder:
    """Finder and loader of modules of `trackmark` under their former names."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """See `importlib.abc.MetaPathFinder`."""
        name = fullname.partition(".")[0]
        if name not in NAMES or _is_foreign(name):
            return None
        # typeshed requires `importlib.abc.Loader`; the import system needs only its two methods.
        return spec_from_loader(fullname, self)  # type: ignore[arg-type]

    def create_module(self, spec: ModuleSpec) -> None:
        """See `importlib.abc.Loader`."""

    def exec_module(self, module: ModuleType) -> None:
        """Replace the empty module by the module of `trackmark`."""
        name = module.__name__
        sys.modules[name] = importlib.import_module(f"trackmark.{name}")


_FINDER = _Finder()


def allow_former_imports() -> None:
    """Install the finder permanently, because a tracker may import modules while it runs."""
    if _FINDER not in sys.meta_path:
        sys.meta_path.insert(0, _FINDER)


@cache
def warn_of_former_imports(file: Path) -> None:
    """Log a warning for the first deprecated import in a Python file."""
    if not file.is_file():
        return
    with suppress(OSError, SyntaxError, ValueError):  # the file was changed after its import
        for line, module in _imports(ast.parse(file.read_bytes())):
            name = module.partition(".")[0]
            if name in NAMES and not _is_foreign(name):
                logging.getLogger("trackmark").warning(
                    f"{file}:{line}: the import name `{module}` is deprecated. The next release "
                    f"removes it. Import `trackmark.{module}` instead."
                )
                return


def _imports(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield line and module of each absolute import."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.lineno, node.module


def _is_foreign(name: str) -> bool:
    """Return whether another package (a folder with `__init__.py`) or module has this name."""
    spec = PathFinder.find_spec(name)
    if spec is None or spec.origin is None:
        return False
    return Path(spec.origin).resolve() != _HOME / name / "__init__.py"
