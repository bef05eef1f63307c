"""Definitions of trackers in processes of their own, from a specification or a table of a file.

docs/external.md describes the keys of such a table.
"""

import hashlib
import os
import re
import shlex
import shutil
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from trackmark import trackers
from trackmark.bench.external import python, trax
from trackmark.bench.external.plugin import ExternalPlugin
from trackmark.bench.external.process import FRAME_SECONDS, START_SECONDS
from trackmark.bench.external.python import PythonClass
from trackmark.bench.external.trax import TraxCommand
from trackmark.bench.external.vot_trackers import read_vot_tracker
from trackmark.datasets.file_digest import file_digests
from trackmark.datasets.source_digest import tree_digest
from trackmark.trackers import Randomness, TrackerError
from trackmark.trackers.base.catalogue import in_file, tracker_name
from trackmark.trackers.base.parameters import unknown_name_error
from trackmark.trackers.base.plain import create_parameters

PACKAGE = Path(str(trackers.__file__)).parent

_TABLE = re.compile(r"(?P<file>.*?\.(?:toml|ini)):(?P<name>[^:=]+)(?P<rest>(:.*)?)", re.DOTALL)
_LIMITS = ("start_timeout", "frame_timeout")
_TRAX_KEYS = (*_LIMITS, "folder", "confidence", "stochastic", "version")


class Definition(BaseModel):
    """Table of a file of trackers."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    file: str = ""
    python: str = ""
    trax: str = ""
    folder: str = ""
    confidence: bool = True
    stochastic: bool = False
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
    version: dict[str, Any]
    parameters: Mapping[str, Any] = {}
    call_seconds: float = 0.0


def split_table(text: str) -> tuple[str, str] | None:
    """Return `file.toml:name` (or `.ini`) and the rest of a specification; None for others."""
    match = _TABLE.fullmatch(text)
    return (f"{match['file']}:{match['name']}", match["rest"]) if match else None


def is_external(name: str, options: Mapping[str, str]) -> bool:
    """Return whether the name and options of a specification select a process of its own."""
    is_python = "python" in options and in_file(name) is not None
    return name == "trax" or is_python or split_table(name) is not None


def open_external(name: str, options: Mapping[str, str]) -> ExternalTracker:
    """Start the process of a tracker once, and return the tracker; see `is_external`.

    Raises `TrackerError` for an invalid definition. Raises `ExternalTrackerError` if the process
    fails.
    """
    options = dict(options)
    requested_name, folder = options.pop("as", ""), Path()
    place = _TABLE.fullmatch(name)
    if place is not None:
        source = Path(place["file"]).expanduser()
        read_table = read_vot_tracker if source.suffix == ".ini" else _read_table
        table = read_table(source, place["name"])
        requested_name, folder = requested_name or place["name"], source.parent
    elif name == "trax":
        if not options.get("command"):
            raise TrackerError("trax: the command is missing. Give trax:command=COMMAND:as=NAME.")
        table = {"trax": options.pop("command").removeprefix('"').removesuffix('"')}
    else:
        table = {"file": name}
    keys = _TRAX_KEYS if "trax" in table else ("python", *_LIMITS)
    table |= {key: options.pop(key) for key in keys if key in options}
    definition = _validate(name, table)
    if definition.trax:
        tracker = _open_trax(name, definition, folder, requested_name)
    else:
        tracker = _open_python(name, definition, folder, requested_name)
    return tracker._replace(
        parameters={**definition.parameters, **options},
        call_seconds=max(definition.start_timeout, definition.frame_timeout),
    )


def _open_python(
    owner: str, definition: Definition, folder: Path, requested_name: str
) -> ExternalTracker:
    place = in_file(definition.file)
    if place is None:
        raise TrackerError(f"{owner}: {definition.file!r} is not a Python file (.py).")
    file = (folder / place[0]).absolute()
    if not file.is_file():
        raise TrackerError(f"{file}: this tracker file does not exist.")
    tracker = PythonClass(
        python=_interpreter(definition.python, folder) if definition.python else sys.executable,
        file=file.resolve(),
        class_name=place[1],
        digest=_digest(file),
        environment=tuple(sorted(definition.environment.items())),
        start_seconds=definition.start_timeout,
        frame_seconds=definition.frame_timeout,
    )
    plugin, libraries = python.load_plugin(tracker)
    source_version = definition.version or f"{tracker.digest}-{plugin.__name__}"
    return ExternalTracker(
        name=tracker_name(plugin, tracker.file, requested_name),
        plugin=plugin,
        file=tracker.file,
        version={"source": source_version, "libraries": libraries},
    )


def _open_trax(
    owner: str, definition: Definition, folder: Path, requested_name: str
) -> ExternalTracker:
    if not requested_name:
        raise TrackerError(f"{owner}: the name is missing. Add as=NAME.")
    folder = (folder / Path(definition.folder).expanduser()).absolute()
    try:
        arguments = tuple(shlex.split(definition.trax))
    except ValueError as error:
        raise TrackerError(f"{owner}: command {definition.trax!r}: {error}.") from None
    command = TraxCommand(
        arguments,
        environment=tuple(sorted(definition.environment.items())),
        folder=folder,
        confidence=definition.confidence,
        start_seconds=definition.start_timeout,
        frame_seconds=definition.frame_timeout,
    )
    files = _command_files(command)
    command = replace(command, digest="-".join(_digest(file) for file in files))
    plugin, name, identifier = trax.load_plugin(
        command,
        Parameters=create_parameters(definition.parameters),
        randomness=Randomness.GENERATOR if definition.stochastic else Randomness.NONE,
    )
    version = {
        "source": definition.version or command.digest,
        "command": definition.trax,
        "name": name,
        "identifier": identifier,
        "libraries": {},
    }
    file = files[0] if files else folder
    return ExternalTracker(tracker_name(plugin, file, requested_name), plugin, file, version)


def _command_files(command: TraxCommand) -> list[Path]:
    """Return the files that a command names by path, or else its program's file in PATH."""
    folder = command.folder or Path()
    files = [folder / Path(text).expanduser() for text in command.command]
    if "-m" in command.command[:-1]:  # a module of Python, as in vot-toolkit's `traxpython`
        module = command.command[command.command.index("-m") + 1].replace(".", "/")
        paths = dict(command.environment).get("PYTHONPATH", "").split(os.pathsep)
        files += [folder / path / f"{module}.py" for path in paths]
    program = shutil.which(command.command[0])
    # `Path.is_file` raises OSError for an argument that is too long for a path.
    existing = [file for file in files if os.path.isfile(file)]  # noqa: PTH113  # see above
    return existing or ([Path(program)] if program else [])


def with_absolute_path(name: str, options: Mapping[str, str]) -> tuple[str, dict[str, str]]:
    """Return name and options with absolute paths, for a process in another folder."""
    if name == "trax":
        return name, {**options, "folder": str(Path(options.get("folder", "")).absolute())}
    file, colon, rest = name.rpartition(":") if split_table(name) else name.partition(":")
    changed = {"python": _interpreter(options["python"], Path())} if "python" in options else {}
    return f"{Path(file).expanduser().absolute()}{colon}{rest}", {**options, **changed}


def close_idle_processes() -> None:
    """End the processes that `open_external` has started and that wait for a tracker."""
    python.close_idle_processes()
    trax.close_unused_processes()


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
    if not (definition.file or definition.trax):
        raise TrackerError(
            f"{owner}: the key 'file' is missing. Name a Python file, or give the command of a "
            "tracker that speaks TraX with the key 'trax'."
        )
    if definition.file and definition.trax:
        raise TrackerError(f"{owner}: the keys 'file' and 'trax' exclude each other. Give one.")
    return definition


def _interpreter(python: str, folder: Path) -> str:
    """Return the path of an interpreter; a name without `/` is looked up in PATH.

    A folder is an environment of `venv` or conda. Links are kept, because they select it.
    """
    if "/" not in python and not (folder / python).is_dir():
        return python
    path = (folder / Path(python).expanduser()).absolute()
    return str(path / "bin" / "python" if path.is_dir() else path)


def _digest(file: Path) -> str:
    """Return the digest of a file, of Python with the modules next to it that it imports."""
    if file.suffix != ".py":
        return file_digests([file])[0][:16]
    try:
        return tree_digest(file, PACKAGE)
    except SyntaxError:  # syntax of another version of Python
        return hashlib.sha256(file.read_bytes()).hexdigest()[:16]
