"""Reader of `trackers.ini`, the file in which vot-toolkit defines trackers."""

import os
import re
import shlex
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from trackmark.trackers import TrackerError

_MODULE = re.compile(r"[a-zA-Z_][\w.]*")
_IGNORED = {"label", "tags", "storage", "restart", "python", "paths", "linkpaths", "protocol"}
_KEYS = {"command": "trax", "timeout": "frame_timeout", "version": "version"}


def convert_vot_table(section: Mapping[str, str], owner: str, folder: Path) -> dict[str, Any]:
    """Return a section of `trackers.ini` as a table of `Definition`.

    The protocols `trax` and `traxpython` are supported. Paths refer to `folder`. `owner` is the
    tracker in messages.

    Raises `TrackerError` for an unsupported key or protocol.
    """
    environment: dict[str, str] = {}
    parameters: dict[str, str] = {}
    table: dict[str, Any] = {"environment": environment, "parameters": parameters}
    for key, value in section.items():
        if key in _KEYS:
            table[_KEYS[key]] = value
        elif key.startswith("env_"):
            environment[key.removeprefix("env_").upper()] = os.path.expandvars(value)
        elif key.startswith("arg_"):
            parameters[key.removeprefix("arg_")] = value
        elif not (
            key in _IGNORED or key.startswith("meta_") or (key, value) == ("socket", "false")
        ):
            raise TrackerError(f"{owner}: {key} = {value} is not supported. Remove the key.")
    protocol, command = section.get("protocol", ""), section.get("command", "")
    if protocol not in ("trax", "traxpython") or not command:
        raise TrackerError(
            f"{owner}: protocol = {protocol}, command = {command}. Expected: protocol trax or "
            "traxpython, and a command. With trax, give the whole command, for example of MATLAB."
        )
    if protocol == "traxpython":
        # As vot-toolkit: the name of a module, or statements.
        kind = "-m" if _MODULE.fullmatch(command) else "-c"
        table["trax"] = shlex.join([section.get("python", sys.executable), kind, command])
        environment["PYTHONPATH"] = _paths(section.get("paths", ""), folder)
        environment["PYTHONUNBUFFERED"] = "1"
    if "linkpaths" in section:
        earlier = environment.get("LD_LIBRARY_PATH")
        linked = _paths(section["linkpaths"], folder)
        environment["LD_LIBRARY_PATH"] = os.pathsep.join(filter(None, [earlier, linked]))
    return table


def _paths(text: str, folder: Path) -> str:
    """Return absolute paths; relative ones refer to the folder."""
    paths = (folder.absolute() / Path(path).expanduser() for path in text.split(os.pathsep))
    return os.pathsep.join(map(str, paths))
