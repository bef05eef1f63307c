"""The runs that were requested of an experiment."""

from collections.abc import Mapping
from dataclasses import dataclass

from trackmark.bench.store.database import Database
from trackmark.bench.store.layout import RunKey, run_key


@dataclass(frozen=True)
class Manifest:
    """Requested runs of an experiment.

    `title`: headline of the report. `versions`: requested `Identity.version` by run, in the order
    of the requests. All repetitions of a tracker on a sequence have one version.
    """

    title: str
    versions: Mapping[RunKey, str]

    def merged_with(self, later: "Manifest") -> "Manifest":
        """Return these requests and later ones; later versions replace those of all repetitions."""
        newest = {(t, s, p): version for (t, s, _, p), version in later.versions.items()}
        versions = {
            (t, s, repetition, p): newest.get((t, s, p), version)
            for (t, s, repetition, p), version in {**self.versions, **later.versions}.items()
        }
        return Manifest(later.title or self.title, versions)


def read_manifest(database: Database) -> Manifest:
    """Return the requested runs; raise `DamagedError` if they are not what was written."""
    rows = database.table("requested")
    return Manifest(database.setting("title"), {run_key(row): row["version"] for row in rows})


def write_manifest(database: Database, manifest: Manifest) -> None:
    """Store the requested runs in place of earlier ones."""
    database.set("title", manifest.title)
    database.delete("requested")
    requested = enumerate(manifest.versions.items())
    database.insert("requested", ((place, *key, version) for place, (key, version) in requested))
