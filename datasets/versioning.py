"""Versions of scenes and trackers, stored in `golden.json` files.

An entry has three parts: a *version*; a digest of the syntax trees of the source; *golden* digests
of the output. The output is images and ground truth of a scene, or boxes of a tracker. While the
source has the stored digest, the version identifies the results. After an edit, the digest of the
new source is appended to the version, so that results of both sources are never mixed. `make seal`
compares the output. If the output is equal, it stores the new digest and keeps the version.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class VersionEntry:
    """Version of a scene or tracker, with the digests of its source and output."""

    # First version: digest of the source file (and library versions, for a scene). Later versions
    # are numbers.
    version: list[Any]
    tree: str  # digest of the syntax trees; see `datasets.source_digest`
    # digests of the output by specification (`multipart/1:scene=2`) and kind of output
    golden: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    # trackers only: import names of the libraries whose versions belong to the tracker's version
    libraries: list[str] = field(default_factory=list)
    # scenes only: metadata by sequence; see `datasets.interface.stored_metadata`
    metadata: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def identity(self, tree: str) -> list[Any]:
        """Return the version; if the source differs from the stored digest, append its digest."""
        return self.version if tree == self.tree else [*self.version, tree]

    def next_version(self) -> list[Any]:
        """Return the number of the next version."""
        number = self.version[0] if isinstance(self.version[0], int) else 1
        return [number + 1]


def find_version(name: str, file: Path) -> VersionEntry | None:
    """Return the entry of a scene or tracker, or None if it has none yet.

    `name` has no options. `file` is a `golden.json`, whose keys may be patterns (`multipart/*`).
    """
    entries = read_versions(file)
    return next((entry for key, entry in entries.items() if fnmatchcase(name, key)), None)


def read_versions(file: Path) -> dict[str, VersionEntry]:
    """Return all entries of a `golden.json` by name or pattern; empty if the file is missing."""
    return dict(_parse(file.read_bytes())) if file.is_file() else {}


def write_versions(file: Path, versions: Mapping[str, VersionEntry]) -> None:
    """Write a `golden.json`."""
    content = {
        name: {key: value for key, value in asdict(version).items() if value}
        for name, version in sorted(versions.items())
    }
    file.write_text(json.dumps(content, indent=1) + "\n")


@cache
def _parse(encoded: bytes) -> dict[str, VersionEntry]:
    return {name: VersionEntry(**fields) for name, fields in json.loads(encoded).items()}
