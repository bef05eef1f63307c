"""The runs that were requested of an experiment."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from trackmark.bench.store.database import Database
from trackmark.bench.store.layout import Cell, cell_of


@dataclass(frozen=True)
class Asked:
    """Requested runs. `title`: headline of the report. `cells`: requested version by run, ordered.

    A version is `Identity.version`. All repetitions of a tracker on a sequence have one version.
    """

    title: str
    cells: Mapping[Cell, str]

    def and_then(self, later: "Asked") -> "Asked":
        """Return these requests and later ones; later versions replace those of all repetitions."""
        versions = {(t, s, p): version for (t, s, _, p), version in later.cells.items()}
        cells = {**self.cells, **later.cells}
        for cell, version in cells.items():
            cells[cell] = versions.get((cell[0], cell[1], cell[3]), version)
        return Asked(later.title or self.title, cells)

    def without(self, cells: Collection[Cell]) -> "Asked":
        """Return the requests except some runs."""
        gone = set(cells)
        return Asked(self.title, {c: v for c, v in self.cells.items() if c not in gone})


def read_asked(database: Database) -> Asked:
    """Return the requested runs; raise `DamagedError` if they are not what was written."""
    rows = database.table("requested")
    return Asked(database.setting("title"), {cell_of(dict(row)): row["version"] for row in rows})


def write_asked(database: Database, asked: Asked) -> None:
    """Store the requested runs in place of earlier ones."""
    database.set("title", asked.title)
    database.delete("requested")
    cells = enumerate(asked.cells.items())
    database.insert("requested", ((place, *cell, version) for place, (cell, version) in cells))
