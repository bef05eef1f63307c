"""What a module's behaviour depends on: its syntax tree, the modules it imports, libraries.

Comments, docstrings and layout count for nothing, and neither do the names and places of
modules: what is formatted, explained or moved stays what it was. Nothing is imported to find
out: files are read and parsed.
"""

import ast
import hashlib
import sys
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from inspect import getmodulename
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class _Import:
    """A name that a module binds by an import statement."""

    level: int  # dots of a relative import
    module: str  # what stands behind `from`; empty for `import`
    name: str  # what is imported
    bound: str  # what it is called in the module

    def dotted(self, package: str) -> str:
        """Dotted name; of `from a import b` it is `a.b`."""
        parts = package.split(".")
        base = parts[: len(parts) - self.level + 1] if self.level else []
        return ".".join([*base, *([self.module] if self.module else []), self.name])


@dataclass(frozen=True)
class _Parsed:
    """A source file: digest of its tree without imports and docstrings, and the imports."""

    digest: str
    imports: tuple[_Import, ...]


def source_digest(file: Path, package: Path) -> tuple[str, dict[str, str]]:
    """Digest of a source file and of all modules of a package that it comes to import.

    Returns `digest`: See `tree_digest`. `libraries`: Version by distribution of every third-party
    library imported by these files.
    """
    digest, libraries = _followed(file, package)
    return digest, library_versions(libraries)


def tree_digest(file: Path, package: Path) -> str:
    """Digest of the same files alone: no library is looked up, which takes longer than the rest.

    `file`: The source file; it may lie inside or outside `package`. `package`: Folder of the
    package whose modules are followed (`.../trackers`). Of a file outside of it, modules of its own
    package, or beside it where it is in none, are followed too. Returns 16 hexadecimal digits over
    the syntax trees of the files, without docstrings. The package's own `__init__.py` counts only
    where names are imported from it.
    """
    return _followed(file, package)[0]


def imported_libraries(file: Path, package: Path) -> list[str]:
    """Import names of the third-party libraries of a source file; see `source_digest`."""
    return sorted(name for name in _followed(file, package)[1] if name in _distributions())


def library_versions(imports: set[str]) -> dict[str, str]:
    """Installed version by distribution of the given top-level import names.

    The standard library and names that no distribution provides are left out.
    """
    return {
        distribution: _version(distribution)
        for name in sorted(imports - sys.stdlib_module_names)
        for distribution in sorted({found.name for found in _distributions().get(name, ())})
    }


@cache
def _version(distribution: str) -> str:
    """Version that is installed: a millisecond each, and every run that is kept tells several."""
    return metadata.version(distribution)


def _followed(file: Path, package: Path) -> tuple[str, set[str]]:
    """Digest of all files that are reached, and what is imported from elsewhere."""
    file, package = file.resolve(), package.resolve()
    inside = file.is_relative_to(package)
    roots: dict[str, Path] = {}
    for known in (package / "__init__.py", file):
        dotted = _dotted_package(known)
        if dotted:
            roots[dotted.partition(".")[0]] = known.parents[dotted.count(".") + 1]
    described: dict[Path, str] = {}
    libraries: set[str] = set()
    todo = [file]
    while todo:
        path = todo.pop()
        if path in described:
            continue
        parsed = _parsed(path.read_bytes(), str(path))
        lines = []
        for imported in parsed.imports:
            full = imported.dotted(_dotted_package(path))
            dotted = full.removeprefix("trackmark.")
            top = dotted.partition(".")[0]
            root = roots.get(top)
            elsewhere = dotted != full or _is_elsewhere(top)
            if root is None and not _dotted_package(file) and not elsewhere:
                root = file.parent
            found = _module(dotted, root) if root is not None else None
            if found is None or (inside and not found[1].is_relative_to(package)):
                libraries |= {top} if root is None and dotted == full else set()
                lines.append(f"{imported.bound} {dotted}")
                continue
            name, source = found
            todo.append(source)
            content = _parsed(source.read_bytes(), str(source)).digest
            lines.append(f"{imported.bound} {content} {dotted.removeprefix(name)}")
        described[path] = "\n".join([parsed.digest, *sorted(lines)])
    text = "\n\n".join(sorted(described.values()))
    return hashlib.sha256(text.encode()).hexdigest()[:16], libraries


@cache
def _distributions() -> dict[str, list[metadata.Distribution]]:
    """What is installed, by import name.

    `importlib.metadata.packages_distributions` takes a path apart for each installed file, a tenth
    of a second or two of every command; only the first folder of each is wanted.
    """
    found: dict[str, list[metadata.Distribution]] = {}
    for distribution in metadata.distributions():
        names = (distribution.read_text("top_level.txt") or "").split()
        for name in set(names) or _first_folders(distribution):
            found.setdefault(name, []).append(distribution)
    return found


def _first_folders(distribution: metadata.Distribution) -> set[str]:
    record = distribution.read_text("RECORD")
    if record is None:
        files = [str(file) for file in distribution.files or ()]
    else:
        files = [line.rpartition(",")[0].rpartition(",")[0] for line in record.splitlines()]
    parts = [file.strip('"').partition("/") for file in files]
    names = {first if slash else getmodulename(first) for first, slash, _ in parts}
    return {name for name in names if name and "." not in name}


def _is_elsewhere(top: str) -> bool:
    """Whether a name to import is that of the standard library, or of something installed."""
    return top in sys.stdlib_module_names or top in _distributions()


@cache
def _dotted_package(file: Path) -> str:
    """Dotted name of the package that contains a file, without `trackmark.`; can be empty."""
    parts: list[str] = []
    folder = file.parent
    while (folder / "__init__.py").is_file() and folder.name != "trackmark":
        parts.insert(0, folder.name)
        folder = folder.parent
    return ".".join(parts)


@cache
def _parsed(content: bytes, filename: str) -> _Parsed:
    imports: list[_Import] = []
    text: list[str] = []
    _dump(ast.parse(content, filename=filename), text, imports)
    digest = hashlib.sha256("".join(text).encode()).hexdigest()
    return _Parsed(digest, tuple(dict.fromkeys(imports)))


def _dump(value: Any, text: list[str], imports: list[_Import]) -> None:
    """Write down a syntax tree, the same for every version of Python: empty fields are left out."""
    if not isinstance(value, ast.AST):
        text.append(repr(value))
        return
    text.append(type(value).__name__ + "(")
    for field, child in ast.iter_fields(value):
        if field in ("ctx", "kind", "type_ignores") or child is None or child == []:
            continue
        text.append(field + "=")
        if not isinstance(child, list):
            _dump(child, text, imports)
            continue
        for position, item in enumerate(child):
            if isinstance(item, ast.Import):
                imports += [_Import(0, "", a.name, a.asname or a.name) for a in item.names]
            elif isinstance(item, ast.ImportFrom):
                imports += [
                    _Import(item.level, item.module or "", a.name, a.asname or a.name)
                    for a in item.names
                ]
            elif not (position == 0 and field == "body" and _is_text(item)):
                # Python 3.12 ends a nested format with an empty text that others don't know.
                if isinstance(value, ast.JoinedStr) and getattr(item, "value", None) == "":
                    continue
                _dump(item, text, imports)
                text.append(",")
    text.append(")")


def _is_text(statement: ast.AST) -> bool:
    """Whether a statement is a text alone: first in a body, it is a docstring."""
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def _module(dotted: str, root: Path) -> tuple[str, Path] | None:
    """Module and file that a dotted name comes from: itself, or the module that holds it."""
    parts = dotted.split(".")
    while parts:
        base = root.joinpath(*parts)
        for candidate in (base.with_suffix(".py"), base / "__init__.py"):
            if candidate.is_file():
                return ".".join(parts), candidate.resolve()
        parts.pop()
    return None
