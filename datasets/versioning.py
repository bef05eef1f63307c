"""Seals: by what version results on a scene, or of a tracker, are known.

A `golden.json` holds an entry a scene (or a tracker): its *version*, the digest of its syntax
trees when it was sealed, and *golden* digests of what it then gave: images and truth, or boxes.
With the sealed trees, the version alone names what comes out. With others, which nobody has
proven to do the same, their digest joins the version, so that what an edited source gives never
mixes with what the sealed one gave. `make seal` proves it: what gives the same keeps its version.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Seal:
    """What was sealed of a scene or a tracker."""

    # what names it: of a first version the digest of its source's bytes (and, of a scene, the
    # versions of its libraries) when it was made; of a later one its number
    version: list[Any]
    tree: str  # digest of the syntax trees; see `datasets.source_digest`
    # digests by what was asked for (`multipart/1:scene=2`) and by part
    golden: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    # of a tracker: import names of the libraries whose versions belong to its version
    libraries: list[str] = field(default_factory=list)
    # of scenes: what their description tells, by sequence; see `datasets.outline`
    known: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def named(self, tree: str) -> list[Any]:
        """What names the version of these trees: the trees too, where they aren't the sealed."""
        return self.version if tree == self.tree else [*self.version, tree]

    def next_version(self) -> list[Any]:
        """Number of the version after this one."""
        number = self.version[0] if isinstance(self.version[0], int) else 1
        return [number + 1]


def seal_of(name: str, file: Path) -> Seal | None:
    """Seal of a scene or tracker; None where there is none yet.

    `name`: Name without options. `file`: The `golden.json`; its keys may be patterns
    (`multipart/*`).
    """
    if not file.is_file():
        return None
    entries = _parsed(file.read_bytes())
    return next((seal for key, seal in entries.items() if fnmatchcase(name, key)), None)


def read_seals(file: Path) -> dict[str, Seal]:
    """All seals of a `golden.json`, by name or pattern."""
    return dict(_parsed(file.read_bytes())) if file.is_file() else {}


def write_seals(file: Path, seals: Mapping[str, Seal]) -> None:
    """Write a `golden.json`."""
    entries = {
        name: {key: value for key, value in asdict(seal).items() if value}
        for name, seal in sorted(seals.items())
    }
    file.write_text(json.dumps(entries, indent=1) + "\n")


@cache
def _parsed(content: bytes) -> dict[str, Seal]:
    return {name: Seal(**entry) for name, entry in json.loads(content).items()}
