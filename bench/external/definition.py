"""Definitions of trackers in processes of their own, from a specification or a table of a file.

docs/external.md describes the keys of such a table.
"""

import configparser
import os
import re
import shlex
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from trackmark.bench.external import TABLE, python, split_table, trax
from trackmark.bench.external.plugin import ExternalPlugin
from trackmark.bench.external.python import PythonOptions
from trackmark.bench.external.trax import TraxOptions
from trackmark.trackers import TrackerError
from trackmark.trackers.base.catalogue import (
    Specification,
    check_name,
    resolve_plugin,
    tracker_name,
)
from trackmark.trackers.base.parameters import unknown_name_error

_LIMITS = ("start_limit", "frame_limit")
_MODULE = re.compile(r"[a-zA-Z_][\w.]*")
_TRAX_OPTIONS = (*_LIMITS, "folder", "confidence", "stochastic", "version")


def open_external(name: str, options: Mapping[str, str]) -> Specification:
    """Start the process of a tracker once, and return the tracker; see `is_external`.

    Its plugin derives from `ExternalPlugin`.

    Raises `TrackerError` for invalid options. Raises `ExternalTrackerError` if the process
    fails.
    """
    plugin: type[ExternalPlugin]
    options = dict(options)
    requested_name, folder = options.pop("as", ""), Path()
    match = TABLE.fullmatch(name)
    if match is not None:
        source = Path(match["file"]).expanduser()
        table = _read_table(source, match["name"])
        requested_name, folder = requested_name or match["name"], source.parent
    elif name == "trax":
        if not options.get("command"):
            raise TrackerError("trax: the command is missing. Give trax:command=COMMAND:as=NAME.")
        if not requested_name:
            raise TrackerError("trax: the name is missing. Add as=NAME.")
        table = {"trax": re.sub('^"([^"]*)"$', r"\1", options.pop("command"))}
    else:
        table = {"file": name}
    if {"file", "trax"} <= table.keys():
        raise TrackerError(f"{name}: give either the key 'file' or the key 'trax', not both.")
    if requested_name:
        check_name(requested_name, name)
    if "images" in table:
        options = {"images": table.pop("images"), **options}
    if "images" in options and "trax" in table:
        raise TrackerError(
            f"{name}: images is {options['images']!r}, but trackers that speak TraX read the "
            "images themselves. Omit images, and convert them in the tracker."
        )
    keys = _TRAX_OPTIONS if "trax" in table else ("python", *_LIMITS)
    table |= {key: options.pop(key) for key in keys if key in options}
    if "trax" in table:
        plugin, file = trax.open_trax_plugin(TraxOptions.checked(name, table), name, folder)
    else:
        plugin, file = python.open_python_plugin(PythonOptions.checked(name, table), name, folder)
    label = tracker_name(plugin, file, requested_name)
    parameters = {**plugin.external_options.parameters, **options}
    return resolve_plugin(plugin, file, label, parameters, ("as", *keys))


def with_absolute_path(name: str, options: Mapping[str, str]) -> tuple[str, dict[str, str]]:
    """Return name and options with absolute paths, for a process in another folder."""
    if name == "trax":
        return name, {**options, "folder": str(Path(options.get("folder", "")).absolute())}
    changed = dict(options)
    if "python" in options:
        changed["python"] = python.find_interpreter(options["python"], Path())
    file, colon, rest = name.rpartition(":") if split_table(name) else name.partition(":")
    return f"{Path(file).expanduser().absolute()}{colon}{rest}", changed


def _read_table(file: Path, name: str) -> dict[str, Any]:
    """Return a table of a TOML file, or a section of `trackers.ini` as such a table."""
    is_vot, parser, tables = file.suffix == ".ini", configparser.ConfigParser(), dict[str, Any]()
    try:
        table_text = file.read_text("utf-8-sig")
        if is_vot:
            parser.read_string(table_text, str(file))
            # A value with an invalid `%` is an error of its own section only.
            tables = {key: dict(parser[key]) if key == name else {} for key in parser.sections()}
        else:
            tables = tomllib.loads(table_text)
    except OSError as error:
        raise TrackerError(f"{file}: {error.strerror}.") from None
    except (ValueError, configparser.Error) as error:
        raise TrackerError(f"{file}: {' '.join(str(error).split())}.") from None
    if name not in tables:
        raise unknown_name_error(f"tracker of {file}", name, tables)
    table: dict[str, Any] = tables[name]
    if not isinstance(table, dict):
        raise TrackerError(f"{file}: {name} is a value. Expected: a table [{name}].")
    return _convert_vot_table(table, f"{file}: [{name}]", file.parent) if is_vot else table


def _convert_vot_table(section: Mapping[str, str], owner: str, folder: Path) -> dict[str, Any]:
    """Return a section of `trackers.ini` of vot-toolkit as a table of `ExternalOptions`.

    Paths refer to `folder`; `owner` is the tracker in messages.
    """
    protocol, command = section.get("protocol", ""), section.get("command", "")
    if protocol not in ("trax", "traxpython") or not command:
        raise TrackerError(
            f"{owner}: protocol = {protocol}, command = {command}. Expected: protocol trax or "
            "traxpython, and a command. With trax, give the whole command, for example of MATLAB."
        )
    variables = _with_prefix(section, "env_").items()
    environment = {name.upper(): os.path.expandvars(value) for name, value in variables}
    if protocol == "traxpython":
        # As vot-toolkit: the name of a module, or statements.
        option = "-m" if _MODULE.fullmatch(command) else "-c"
        command = shlex.join([section.get("python", sys.executable), option, command])
        environment["PYTHONPATH"] = _paths(section.get("paths", ""), folder)
        environment["PYTHONUNBUFFERED"] = "1"
    if "linkpaths" in section:
        earlier = environment.get("LD_LIBRARY_PATH")
        linked = _paths(section["linkpaths"], folder)
        environment["LD_LIBRARY_PATH"] = os.pathsep.join(filter(None, [earlier, linked]))
    table = {"trax": command, "environment": environment, "version": section.get("version", "")}
    if "timeout" in section:
        table["frame_limit"] = section["timeout"]
    if "images" in section:
        table["images"] = section["images"]
    return {**table, "parameters": _with_prefix(section, "arg_")}


def _with_prefix(section: Mapping[str, str], prefix: str) -> dict[str, str]:
    """Return the values of keys that start with a prefix, by the rest of the keys."""
    return {key.removeprefix(prefix): section[key] for key in section if key.startswith(prefix)}


def _paths(joined: str, folder: Path) -> str:
    """Return absolute paths; relative ones refer to the folder."""
    paths = (folder.absolute() / Path(path).expanduser() for path in joined.split(os.pathsep))
    return os.pathsep.join(map(str, paths))
