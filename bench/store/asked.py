"""What was ever asked for: a report knows by it what is missing."""

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from bench.store.files import ResultsError, locked, write_atomically
from bench.store.layout import SCHEMA, Cell, check_schema, run_path
from bench.store.seal import PLACEHOLDER, check, sealed

__all__ = ["Asked", "add_asked", "read_asked", "withdraw"]


@dataclass(frozen=True)
class Asked:
    """What an experiment was asked for.

    Attributes
    ----------
    title : str
        Headline of its report.
    cells : mapping of Cell to str
        The version (`Identity.version`) that was asked for last, by cell.
    """

    title: str
    cells: Mapping[Cell, str]

    def and_then(self, later: "Asked") -> "Asked":
        """What was asked for, with what is asked for later; the later version of a cell counts."""
        now = {_series(cell): version for cell, version in later.cells.items()}
        cells = {cell: now.get(_series(cell), version) for cell, version in self.cells.items()}
        return Asked(later.title or self.title, {**cells, **later.cells})


def read_asked(folder: Path) -> Asked:
    """What was asked for so far; empty for a new folder."""
    file = folder / "plan.json"
    if not file.is_file():
        return Asked("", {})
    try:
        content = file.read_bytes()
        plan = json.loads(content)
        check_schema(file, plan["schema"])
        check(file, content)
        cells = {tuple(cell[:4]): cell[4] for cell in plan["cells"]}
        return Asked(plan["title"], cells)
    except (ValueError, KeyError, TypeError, IndexError) as error:
        if isinstance(error, ResultsError):
            raise
        raise ResultsError(
            f"{file} is damaged ({type(error).__name__}: {error}). Remove it and run again."
        ) from None


def add_asked(folder: Path, asked: Asked) -> None:
    """Add to what was asked for so far."""
    with locked(folder):
        _write(folder, read_asked(folder).and_then(asked))


def withdraw(folder: Path, paths: Collection[str]) -> None:
    """Take back what was asked for, by the paths of runs relative to the folder."""
    gone = set(paths)
    with locked(folder):
        asked = read_asked(folder)
        kept = {cell: v for cell, v in asked.cells.items() if str(run_path(*cell)) not in gone}
        _write(folder, Asked(asked.title, kept))


def _write(folder: Path, asked: Asked) -> None:
    cells = [[*cell, version] for cell, version in asked.cells.items()]
    plan = {"schema": SCHEMA, "seal": PLACEHOLDER, "title": asked.title, "cells": cells}
    write_atomically(folder / "plan.json", sealed(json.dumps(plan).encode()))


def _series(cell: Cell) -> tuple[str, str, str]:
    tracker, sequence, _, protocol = cell
    return tracker, sequence, protocol
