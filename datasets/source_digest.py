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
        Folder of the top-level package whose modules are followed (`.../trackers`). Modules
        of the file's own package, or beside a file that is in none, are followed too.

    Returns
    -------
    digest : str
        16 hexadecimal digits over names and bytes of the files. The package's own
        `__init__.py` counts only where names are imported from it.
    libraries : dict of str to str
        Version by distribution of every third-party library imported by these files.
    """
    own = _dotted_package(file).partition(".")[0]
    roots = {package.name: package.parent}
    if own:
        roots[own] = file.parents[_dotted_package(file).count(".") + 1]
    modules: dict[str, Path] = {}
    libraries: set[str] = set()
    todo = [("", file)]
    while todo:
        name, path = todo.pop()
        if name in modules:
            continue
        modules[name] = path
        for imported in _imports(path, _dotted_package(path)):
            top = imported.partition(".")[0]
            root = roots.get(top)
            if root is None and top not in _distributions() and top not in sys.stdlib_module_names:
                root = file.parent if not _dotted_package(file) else None
            found = _module(imported, root) if root is not None else None
            if found is None and root is None:
                libraries.add(top)
            elif found is not None and found[1] != file:
                todo.append(found)
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


def _dotted_package(file: Path) -> str:
    """Dotted name of the package that a file lies in; empty where it is in none."""
    parts: list[str] = []
    folder = file.parent
    while (folder / "__init__.py").is_file():
        parts.insert(0, folder.name)
        folder = folder.parent
    return ".".join(parts)


def _imports(path: Path, dotted: str) -> Iterator[str]:
    """Dotted names that a file imports, `dotted` being its package; of `from a import b` `a.b`."""
    for node in ast.walk(ast.parse(path.read_bytes(), filename=str(path))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = dotted.split(".")[: len(dotted.split(".")) - node.level + 1]
            prefix = [*(base if node.level else []), *([node.module] if node.module else [])]
            yield from (".".join([*prefix, alias.name]) for alias in node.names)


def _module(dotted: str, root: Path) -> tuple[str, Path] | None:
    """Module and file that a dotted name comes from: itself, or the module that holds it."""
    parts = dotted.split(".")
    while parts:
        base = root.joinpath(*parts)
        for candidate in (base.with_suffix(".py"), base / "__init__.py"):
            if candidate.is_file():
                return ".".join(parts), candidate
        parts.pop()
    return None
