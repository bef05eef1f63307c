"""Definitions of trackers in processes of their own, from a specification or a table of a file.

```toml
[mine]
file = "my_tracker.py"                         # with `:Class` if the file has several trackers
python = "envs/torch/bin/python"               # by default this interpreter
parameters = { size = 2.0 }
environment = { CUDA_VISIBLE_DEVICES = "0" }
start_timeout = 300                            # start, creation and `init` [s]
frame_timeout = 60                             # `update` [s]
version = "1.2"                                # replaces the digest of the source
```
"""

import hashlib
import re
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from trackmark import trackers
from trackmark.bench.external.plugin import ExternalPlugin
from trackmark.bench.external.process import FRAME_SECONDS, START_SECONDS
from trackmark.bench.external.python import PythonClass, load_plugin
from trackmark.datasets.source_digest import tree_digest
from trackmark.trackers import TrackerError
from trackmark.trackers.base.catalogue import in_file, tracker_name
from trackmark.trackers.base.parameters import unknown_name_error

PACKAGE = Path(str(trackers.__file__)).parent

_TABLE = re.compile(r"(?P<file>.*?\.toml):(?P<name>[^:=]+)(?P<rest>(:.*)?)", re.DOTALL)
_LIMITS = ("start_timeout", "frame_timeout")


class Definition(BaseModel):
    """Table of a file of trackers."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    file: str = ""
    python: str = ""
    parameters: Mapping[str, bool | int | float | str] = {}
    environment: Mapping[str, str] = {}
    start_timeout: float = Field(START_SECONDS, gt=0)
    frame_timeout: float = Field(FRAME_SECONDS, gt=0)
    version: str = ""


class ExternalTracker(NamedTuple):
    """Tracker in a process of its own.

    `parameters` are those of the definition, with the options of the specification. `version` is
    part of `Identity`. `call_seconds` is the longest time limit of a call [s].
    """

    name: str
    plugin: type[ExternalPlugin]
    file: Path
    parameters: dict[str, Any]
    version: dict[str, Any]
    call_seconds: float


def split_table(text: str) -> tuple[str, str] | None:
    """Return `file.toml:name` and the rest of a specification; None for other specifications."""
    match = _TABLE.fullmatch(text)
    return (f"{match['file']}:{match['name']}", match["rest"]) if match else None


def is_external(name: str, options: Mapping[str, str]) -> bool:
    """Return whether the name and options of a specification select a process of its own."""
    return split_table(name) is not None or ("python" in options and in_file(name) is not None)


def open_external(name: str, options: Mapping[str, str]) -> ExternalTracker:
    """Start the process of a tracker once, and return the tracker; see `is_external`.

    Raises `TrackerError` for an invalid definition. Raises `ExternalTrackerError` if the process
    fails.
    """
    keys = ("python", *_LIMITS)
    table = {key: options[key] for key in keys if key in options}
    parameters = {key: value for key, value in options.items() if key not in keys}
    requested_name, folder = parameters.pop("as", ""), Path()
    place = _TABLE.fullmatch(name)
    if place is None:
        definition = _validate(name, {"file": name, **table})
    else:
        source = Path(place["file"]).expanduser()
        definition = _validate(name, {**_read_table(source, place["name"]), **table})
        requested_name, folder = requested_name or place["name"], source.parent
    tracker = _python_class(name, definition, folder)
    plugin, libraries = load_plugin(tracker)
    source_version = definition.version or f"{tracker.digest}-{plugin.__name__}"
    return ExternalTracker(
        name=tracker_name(plugin, tracker.file, requested_name),
        plugin=plugin,
        file=tracker.file,
        parameters={**definition.parameters, **parameters},
        version={"source": source_version, "libraries": libraries},
        call_seconds=max(tracker.start_seconds, tracker.frame_seconds),
    )


def with_absolute_path(name: str, options: Mapping[str, str]) -> tuple[str, dict[str, str]]:
    """Return name and options with absolute paths, for a process in another folder."""
    file, colon, rest = name.rpartition(":") if split_table(name) else name.partition(":")
    changed = {"python": _interpreter(options["python"], Path())} if "python" in options else {}
    return f"{Path(file).expanduser().absolute()}{colon}{rest}", {**options, **changed}


def _read_table(file: Path, name: str) -> dict[str, Any]:
    try:
        tables = tomllib.loads(file.read_text("utf-8-sig"))
    except OSError as error:
        raise TrackerError(f"{file}: {error.strerror}.") from None
    except ValueError as error:
        raise TrackerError(f"{file}: {error}.") from None
    if name not in tables:
        raise unknown_name_error(f"tracker of {file}", name, tables)
    table = tables[name]
    if not isinstance(table, dict):
        raise TrackerError(f"{file}: {name} is a value. Expected: a table [{name}].")
    return table


def _validate(owner: str, table: Mapping[str, Any]) -> Definition:
    for key in table:
        if key not in Definition.model_fields:
            raise unknown_name_error(f"key of {owner}", key, Definition.model_fields)
    try:
        definition = Definition.model_validate(table)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        raise TrackerError(f"{owner}: {key}={first['input']!r}: {first['msg']}.") from None
    if not definition.file:
        raise TrackerError(f"{owner}: the key 'file' is missing. Name a Python file.")
    return definition


def _python_class(owner: str, definition: Definition, folder: Path) -> PythonClass:
    place = in_file(definition.file)
    if place is None:
        raise TrackerError(f"{owner}: {definition.file!r} is not a Python file (.py).")
    file = (folder / place[0]).absolute()
    if not file.is_file():
        raise TrackerError(f"{file}: this tracker file does not exist.")
    return PythonClass(
        python=_interpreter(definition.python, folder) if definition.python else sys.executable,
        file=file.resolve(),
        class_name=place[1],
        digest=_digest(file),
        environment=tuple(sorted(definition.environment.items())),
        start_seconds=definition.start_timeout,
        frame_seconds=definition.frame_timeout,
    )


def _interpreter(python: str, folder: Path) -> str:
    """Return the path of an interpreter; a name without `/` is looked up in PATH.

    A folder is an environment of `venv` or conda. Links are kept, because they select it.
    """
    if "/" not in python and not (folder / python).is_dir():
        return python
    path = (folder / Path(python).expanduser()).absolute()
    return str(path / "bin" / "python" if path.is_dir() else path)


def _digest(file: Path) -> str:
    """Return the digest of a source file and of the modules next to it that it imports."""
    try:
        return tree_digest(file, PACKAGE)
    except SyntaxError:  # syntax of another version of Python
        return hashlib.sha256(file.read_bytes()).hexdigest()[:16]
