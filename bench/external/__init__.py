"""Trackers in processes of their own, and the specifications that select such a process."""

import re
from collections.abc import Mapping

from trackmark.trackers.base.catalogue import in_file

TABLE = re.compile(r"(?P<file>.*?\.(?:toml|ini)):(?P<name>[^:=]+)(?P<rest>(:.*)?)", re.DOTALL)
"""Specification of a tracker that a table of a file defines."""

FRAME_SECONDS = 60.0
"""Default time limit of a call of a tracker with the interpreter of trackmark [s]."""


def split_table(spec: str) -> tuple[str, str] | None:
    """Return `file.toml:name` (or `.ini`) and the rest of a specification; None for others."""
    match = TABLE.fullmatch(spec)
    return (f"{match['file']}:{match['name']}", match["rest"]) if match else None


def is_external(name: str, options: Mapping[str, str]) -> bool:
    """Return whether the name and options of a specification select another environment."""
    is_python = "python" in options and in_file(name) is not None
    return name == "trax" or is_python or split_table(name) is not None
