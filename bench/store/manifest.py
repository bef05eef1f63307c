"""List of the requested runs of an experiment."""

from collections.abc import Mapping
from dataclasses import dataclass

from trackmark.bench.store.database import Database
from trackmark.bench.store.layout import RunKey, run_key


@dataclass(frozen=True)
class Manifest:
    """Requested runs of an experiment.

    `title` is the title of the report. `versions` holds the requested `Identity.version` by run, in
    the order of the requests. All repetitions of a tracker on a sequence have the same version.
    """

    title: str
    versions: Mapping[RunKey, str]

    def merged_with(self, later: "Manifest") -> "Manifest":
        """Return these and later requests; a later version applies to all repetitions."""
        newest = {(t, s, p): version for (t, s, _, p), version in later.versions.items()}
        versions = {
            (t, s, repetition, p): newest.get((t, s, p), version)
            for (t, s, repetition, p), version in {**self.versions, **later.versions}.items()
        }
        return Manifest(later.title or self.title, versions)


def read_manifest(database: Database) -> Manifest:
    """Return the requested runs; raise `DamagedError` if their rows are damaged."""
    rows = database.table("requested")
    return Manifest(database.setting("title"), {run_key(row): row["version"] for row in rows})


def write_manifest(database: Database, manifest: Manifest) -> None:
    """Replace the stored list of requested runs."""
    database.set("title", manifest.title)
    database.delete("requested")
    requested = enumerate(manifest.versions.items())
    database.insert("requested", ((place, *key, version) for place, (key, version) in requested))
