"""Reader of `trackers.ini`, the file in which vot-toolkit defines trackers."""

import configparser
import os
import re
import shlex
import sys
from pathlib import Path
from typing import Any

from trackmark.trackers import TrackerError
from trackmark.trackers.base.parameters import unknown_name_error

_MODULE = re.compile(r"[a-zA-Z_][\w.]*")
_IGNORED = {"label", "tags", "storage", "restart", "python", "paths", "linkpaths", "protocol"}
_KEYS = {"command": "trax", "timeout": "frame_timeout", "version": "version"}


def read_vot_tracker(file: Path, name: str) -> dict[str, Any]:
    """Return a section of `trackers.ini` as a table of `bench.external.definition`.

    The protocols `trax` and `traxpython` are supported. Paths refer to the folder of the file.

    Raises `TrackerError` for an unreadable file, an unknown section, and an unsupported key.
    """
    parser = configparser.ConfigParser()
    try:
        parser.read_string(file.read_text("utf-8-sig"), str(file))
        if name not in parser.sections():
            raise unknown_name_error(f"tracker of {file}", name, parser.sections())
        section = dict(parser[name])
    except OSError as error:
        raise TrackerError(f"{file}: {error.strerror}.") from None
    except (configparser.Error, UnicodeDecodeError) as error:
        raise TrackerError(f"{file}: {' '.join(str(error).split())}.") from None
    where = f"{file}: [{name}]"
    table: dict[str, Any] = {"environment": {}, "parameters": {}}
    for key, value in section.items():
        if key in _KEYS:
            table[_KEYS[key]] = value
        elif key.startswith("env_"):
            table["environment"][key.removeprefix("env_").upper()] = os.path.expandvars(value)
        elif key.startswith("arg_"):
            table["parameters"][key.removeprefix("arg_")] = value
        elif not (
            key in _IGNORED or key.startswith("meta_") or (key, value) == ("socket", "false")
        ):
            raise TrackerError(f"{where}: {key} = {value} is not supported. Remove the key.")
    protocol = section.get("protocol", "")
    if protocol not in ("trax", "traxpython") or not section.get("command"):
        raise TrackerError(
            f"{where}: protocol = {protocol}, command = {section.get('command', '')}. Expected: "
            "protocol trax or traxpython, and a command. With trax, give the whole command, for "
            "example of MATLAB."
        )
    if protocol == "traxpython":
        # As vot-toolkit: the name of a module, or statements.
        kind = "-m" if _MODULE.fullmatch(section["command"]) else "-c"
        python = section.get("python", sys.executable)
        table["trax"] = shlex.join([python, kind, section["command"]])
        table["environment"]["PYTHONPATH"] = _paths(section.get("paths", ""), file)
        table["environment"]["PYTHONUNBUFFERED"] = "1"
    if "linkpaths" in section:
        earlier = table["environment"].get("LD_LIBRARY_PATH", "")
        linked = _paths(section["linkpaths"], file)
        table["environment"]["LD_LIBRARY_PATH"] = os.pathsep.join(filter(None, [earlier, linked]))
    return table


def _paths(text: str, file: Path) -> str:
    """Return absolute paths; relative ones refer to the folder of the file."""
    folder = file.absolute().parent
    return os.pathsep.join(str(folder / Path(path).expanduser()) for path in text.split(os.pathsep))
