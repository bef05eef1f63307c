"""What a module's behaviour depends on: its source, the modules it imports, libraries.

Nothing is imported to find out: the import statements are read.
"""

import ast
import hashlib
import sys
from collections.abc import Iterator
from functools import cache
from importlib import metadata
from pathlib import Path

__all__ = ["library_versions", "source_digest"]


def source_digest(file: Path, package: Path) -> tuple[str, dict[str, str]]:
    """Digest of a source file and of all modules of a package that it comes to import.

    Parameters
    ----------
    file : Path
        The source file; it may lie inside or outside `package`.
    package : Path
        Folder of the top-level package whose modules are followed (`.../trackers`).

    Returns
    -------
    digest : str
        16 hexadecimal digits over names and bytes of the files. The package's own
        `__init__.py` counts only where names are imported from it.
    libraries : dict of str to str
        Version by distribution of every third-party library imported by these files.
    """
    modules: dict[str, Path] = {}
    libraries: set[str] = set()
    todo = [("", file)]
    while todo:
        name, path = todo.pop()
        if name in modules:
            continue
        modules[name] = path
        for imported in _imports(path):
            top = imported.partition(".")[0]
            if top == package.name:
                found = _module(imported, package)
                if found is not None and found[1] != file:
                    todo.append(found)
            else:
                libraries.add(top)
    digest = hashlib.sha256()
    for name in sorted(modules):
        digest.update(name.encode() + b"\0" + modules[name].read_bytes() + b"\0")
    return digest.hexdigest()[:16], library_versions(libraries)


def library_versions(imports: set[str]) -> dict[str, str]:
    """Installed version by distribution of the given top-level import names.

    The standard library and names that no distribution provides are left out.
    """
    return {
        distribution: metadata.version(distribution)
        for name in sorted(imports - sys.stdlib_module_names)
        for distribution in sorted(set(_distributions().get(name, ())))
    }


@cache
def _distributions() -> dict[str, list[str]]:
    return dict(metadata.packages_distributions())


def _imports(path: Path) -> Iterator[str]:
    """Dotted names that a file imports; of `from a import b` both `a.b` and `a`."""
    for node in ast.walk(ast.parse(path.read_bytes(), filename=str(path))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _module(dotted: str, package: Path) -> tuple[str, Path] | None:
    """Module and file that a dotted name comes from: itself, or the module that holds it."""
    parts = dotted.split(".")
    while parts:
        base = package.parent.joinpath(*parts)
        for candidate in (base.with_suffix(".py"), base / "__init__.py"):
            if candidate.is_file():
                return ".".join(parts), candidate
        parts.pop()
    return None
