"""Digests of modules with the modules that they import, and versions of imported libraries.

Comments, docstrings, layout, module names and folders do not change the digest: code can be
formatted, documented and moved. Files are parsed, not imported.
"""

import ast
import hashlib
import importlib
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from inspect import getmodulename
from operator import attrgetter
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class _Import:
    """Name that a module binds with an import statement."""

    level: int  # number of dots of a relative import
    module: str  # module after `from`; empty for `import`
    name: str  # imported name
    bound: str  # name that the importing module binds

    def dotted(self, package: str) -> str:
        """Return the dotted name, `a.b` for `from a import b`."""
        parts = package.split(".")
        base = parts[: len(parts) - self.level + 1] if self.level else []
        return ".".join([*base, *([self.module] if self.module else []), self.name])


def source_digest(file: Path, package: Path) -> tuple[str, dict[str, str]]:
    """Return the digest of a source file with all modules that it imports, and library versions.

    The first value is that of `tree_digest`. The second is the version of each third-party library
    that these files import, by distribution.
    """
    digest, libraries = _follow_imports(file, package)
    return digest, library_versions(libraries)


def tree_digest(file: Path, package: Path, unnamed: Iterable[Path] = ()) -> str:
    """Return the digest of a source file and of all modules that it imports, 16 hexadecimal digits.

    `unnamed` are files that the modules import by file name, which no import statement names.

    Libraries are not looked up, because this would take most of the time. `package` is the folder
    of the package whose modules are included (`.../trackers`). If `file` is outside this folder,
    modules of the file's package or folder are included too. The `__init__.py` of the package is
    included only if names are imported from it.
    """
    return _follow_imports(file, package, unnamed)[0]


def imported_libraries(file: Path, package: Path) -> list[str]:
    """Return the import names of a source file's third-party libraries; see `source_digest`."""
    return sorted(name for name in _follow_imports(file, package)[1] if name in _distributions())


def library_versions(imports: set[str]) -> dict[str, str]:
    """Return the installed versions of top-level import names, by distribution.

    Names of the standard library and names without a distribution are omitted.
    """
    versions: dict[str, str] = {}
    for name in sorted(imports - sys.stdlib_module_names):
        versions |= _versions(name)
    return versions


def library_version(name: str) -> str:
    """Return the version of an installed library by its import name, such as `cv2`.

    The library itself names its version, because distributions have many names or none: OpenCV is
    installed as `opencv-python`, `opencv-contrib-python-headless` or by Conda without a name. The
    result is empty if the library is not installed.
    """
    try:
        module = importlib.import_module(name)
    except ImportError:
        return ""
    version = getattr(module, "__version__", "")
    return str(version or next(iter(library_versions({name}).values()), "unknown"))


@cache
def _versions(name: str) -> dict[str, str]:
    """Return the versions of an import name's distributions, cached: a lookup takes some ms."""
    # An interrupted installation leaves distributions without a name.
    owners = [owner for owner in _distributions().get(name, ()) if owner.metadata["Name"]]
    versions: dict[str, str] = {}
    for owner in sorted(owners, key=attrgetter("name")):
        versions.setdefault(owner.name, owner.version)
    return versions


def _follow_imports(
    file: Path, package: Path, unnamed: Iterable[Path] = ()
) -> tuple[str, set[str]]:
    """Return the digest of all imported files, and the import names of libraries."""
    file, package = file.resolve(), package.resolve()
    inside = file.is_relative_to(package)
    roots: dict[str, Path] = {}
    for source in (package / "__init__.py", file):
        dotted = _dotted_package(source)
        if dotted:
            roots[dotted.partition(".")[0]] = source.parents[dotted.count(".") + 1]
    contents: dict[Path, str] = {}
    libraries: set[str] = set()
    pending = [file, *(source.resolve() for source in unnamed)]
    while pending:
        path = pending.pop()
        if path in contents:
            continue
        own_digest, imports = _parse(path.read_bytes(), str(path))
        lines = []
        for imported in imports:
            full = imported.dotted(_dotted_package(path))
            dotted = full.removeprefix("trackmark.")
            top = dotted.partition(".")[0]
            root = roots.get(top)
            is_installed = top in sys.stdlib_module_names or top in _distributions()
            is_external = dotted != full or is_installed
            if root is None and not _dotted_package(file) and not is_external:
                root = file.parent
            module = _find_module(dotted, root) if root is not None else None
            if module is None or (inside and not module[1].is_relative_to(package)):
                libraries |= {top} if root is None and dotted == full else set()
                lines.append(f"{imported.bound} {dotted}")
                continue
            name, source = module
            pending.append(source)
            digest, _ = _parse(source.read_bytes(), str(source))
            lines.append(f"{imported.bound} {digest} {dotted.removeprefix(name)}")
        contents[path] = "\n".join([own_digest, *sorted(lines)])
    joined = "\n\n".join(sorted(contents.values()))
    return hashlib.sha256(joined.encode()).hexdigest()[:16], libraries


@cache
def _distributions() -> dict[str, list[metadata.Distribution]]:
    """Return the installed distributions by import name.

    `importlib.metadata.packages_distributions` parses the path of each installed file, which takes
    0.1 to 0.2 s per command; only the first folder of each path is needed here.
    """
    owners: dict[str, list[metadata.Distribution]] = {}
    for distribution in metadata.distributions():
        names = (distribution.read_text("top_level.txt") or "").split()
        for name in set(names) or _first_folders(distribution):
            owners.setdefault(name, []).append(distribution)
    return owners


def _first_folders(distribution: metadata.Distribution) -> set[str]:
    """Return the top-level import names of a distribution's files."""
    record = distribution.read_text("RECORD")
    names: set[str] = set()
    for line in map(str, distribution.files or ()) if record is None else record.splitlines():
        # Digest and size follow the path in RECORD.
        file = line if record is None else line.rsplit(",", 2)[0]
        first, slash, _ = file.strip('"').partition("/")
        name = first if slash else getmodulename(first)
        if name and "." not in name:
            names.add(name)
    return names


@cache
def _dotted_package(file: Path) -> str:
    """Return the dotted name of a file's package, without `trackmark.`; it can be empty."""
    names: list[str] = []
    folder = file.parent
    while (folder / "__init__.py").is_file() and folder.name != "trackmark":
        names.insert(0, folder.name)
        folder = folder.parent
    return ".".join(names)


@cache
def _parse(source: bytes, filename: str) -> tuple[str, tuple[_Import, ...]]:
    """Return the digest of a syntax tree without imports and docstrings, and the imports."""
    imports: list[_Import] = []
    dumped: list[str] = []
    _dump(ast.parse(source, filename=filename), dumped, imports)
    digest = hashlib.sha256("".join(dumped).encode()).hexdigest()
    return digest, tuple(dict.fromkeys(imports))


def _dump(value: Any, dumped: list[str], imports: list[_Import]) -> None:
    """Append the text of a syntax tree, without fields that depend on Python's version."""
    if not isinstance(value, ast.AST):
        dumped.append(repr(value))
        return
    dumped.append(type(value).__name__ + "(")
    for field, child in ast.iter_fields(value):
        if field in ("ctx", "kind", "type_ignores") or child is None or child == []:
            continue
        dumped.append(field + "=")
        if not isinstance(child, list):
            _dump(child, dumped, imports)
            continue
        for position, item in enumerate(child):
            if isinstance(item, ast.Import | ast.ImportFrom):
                level, module = getattr(item, "level", 0), getattr(item, "module", None) or ""
                imports += [
                    _Import(level, module, bound.name, bound.asname or bound.name)
                    for bound in item.names
                ]
            elif not (position == 0 and field == "body" and _is_text_statement(item)):
                # Python 3.12 ends a nested format with an empty text, other versions do not.
                if isinstance(value, ast.JoinedStr) and getattr(item, "value", None) == "":
                    continue
                _dump(item, dumped, imports)
                dumped.append(",")
    dumped.append(")")


def _is_text_statement(statement: ast.AST) -> bool:
    """Return whether a statement consists of a text, such as a docstring."""
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def _find_module(dotted: str, root: Path) -> tuple[str, Path] | None:
    """Return the module that a dotted name names or belongs to, and the file of the module."""
    names = dotted.split(".")
    while names:
        base = root.joinpath(*names)
        for candidate in (base.with_suffix(".py"), base / "__init__.py"):
            if candidate.is_file():
                return ".".join(names), candidate.resolve()
        names.pop()
    return None
